// The noise that is told of frames beside the noise that they have. Hypothesis: told^2, over seeds
// 1 to 128, is the variance of a pixel over these seeds at the same sites, mean over the pixels
// with a surface and over the squared mean radiance. Over 128 seeds each pixel is a probe once, so
// a case has 1536 probes. The limit is 20 %; standard errors are 2 to 3 %. Of `environment` they
// are 16 to 39 %, as few pixels make most of its noise: too much for a test.
#include <gtest/gtest.h>

#include <algorithm>

#include "common/image/noise.h"
#include "tests/support/small_scene.h"

namespace baton {
namespace {

constexpr int kSeeds = 128;
constexpr double kLimit = 0.2;

enum class Moves { nothing, light, camera };

JobSpec noise_job(Method method, int sites, Moves moves) {
  JobSpec job = test::box_job();
  job.frames = test::frame_numbers(3);
  job.image.width = 48;
  job.image.height = 32;
  job.image.sites = sites;
  job.image.site_seed = 5;
  job.sampling.method = method;
  job.sampling.num_particles = 8;
  job.sampling.num_candidates = 64;
  job.output.aovs.clear();
  job.output.background = Background::transparent;
  if (moves == Moves::light) job.environment.rotation_deg_per_frame = 5;
  if (moves == Moves::camera) test::set_in_motion(job, true, false);
  return job;
}

/// Sums over seeds of one frame.
class FrameOverSeeds {
 public:
  void add(const FilmTile& film) {
    const FrameNoise noise = noise_of_film(film);
    ASSERT_TRUE(noise.is_told());
    const double square = double{noise.relative()} * noise.relative();
    told_squares_ += square / kSeeds;
    told_fourths_ += square * square / kSeeds;
    const std::vector<double> grey = test::mean_rgb(film);
    sum_.resize(grey.size());
    squares_.resize(grey.size());
    const auto alpha = test::channel(film, "A");
    alpha_.resize(grey.size());
    for (std::size_t i = 0; i < grey.size(); ++i) alpha_[i] = std::max(alpha_[i], alpha[i]);
    for (std::size_t i = 0; i < grey.size(); ++i) {
      sum_[i] += grey[i] / kSeeds;
      squares_[i] += grey[i] * grey[i] / kSeeds;
    }
  }
  double told() const { return std::sqrt(told_squares_); }
  /// Standard error of told(), as a share of it.
  double error_share() const {
    return std::sqrt((told_fourths_ / (told_squares_ * told_squares_) - 1) / (kSeeds - 1)) / 2;
  }
  double truth() const {
    double variance = 0, light = 0, pixels = 0;
    for (std::size_t i = 0; i < sum_.size(); ++i) {
      if (alpha_[i] == 0) continue;
      variance += (squares_[i] - sum_[i] * sum_[i]) * kSeeds / (kSeeds - 1);
      light += sum_[i];
      pixels += 1;
    }
    return std::sqrt(variance * pixels) / light;
  }

 private:
  double told_squares_ = 0, told_fourths_ = 0;
  std::vector<double> sum_, squares_;
  std::vector<float> alpha_;
};

std::vector<FrameOverSeeds> repeat(JobSpec job) {
  std::vector<FrameOverSeeds> frames(job.frames.size());
  for (int seed = 1; seed <= kSeeds; ++seed) {
    job.seed = static_cast<std::uint64_t>(seed);
    const std::vector<FilmTile> films = test::render_tile(job).films;
    const std::size_t first = films.size() - frames.size();  // of the last sweep
    for (std::size_t f = 0; f < frames.size(); ++f) frames[f].add(films.at(first + f));
  }
  return frames;
}

void expect_truth(const JobSpec& job, double least = 1 - kLimit, double most = 1 + kLimit) {
  const std::vector<FrameOverSeeds> frames = repeat(job);
  for (const FrameOverSeeds* frame : {&frames.front(), &frames.back()}) {
    const double error = frame->error_share();
    std::printf("  %-13s %d sites, told %.4f, is %.4f: %.3f +- %.3f\n",
                std::string(traits(job.sampling.method).name).c_str(), job.image.sites,
                frame->told(), frame->truth(), frame->told() / frame->truth(), error);
    EXPECT_GT(frame->told() / frame->truth(), least);
    EXPECT_LT(frame->told() / frame->truth(), most);
  }
}

class ToldNoise : public testing::TestWithParam<std::tuple<Method, int>> {
 protected:
  void expect_truth_while(Moves moves) {
    const auto [method, sites] = GetParam();
    expect_truth(noise_job(method, sites, moves));
  }
};
TEST_P(ToldNoise, IsTrueAtRest) { expect_truth_while(Moves::nothing); }
TEST_P(ToldNoise, IsTrueUnderTurningLight) { expect_truth_while(Moves::light); }
TEST_P(ToldNoise, IsTrueWhileTheCameraMoves) { expect_truth_while(Moves::camera); }
INSTANTIATE_TEST_SUITE_P(Methods, ToldNoise,
                         testing::Combine(testing::Values(Method::pool, Method::bidirectional,
                                                          Method::mis),
                                          testing::Values(1, 4)));

TEST(ToldNoiseOf, RatioAndReferenceIsTrue) {
  expect_truth(noise_job(Method::ratio, 4, Moves::light));
  JobSpec job = noise_job(Method::reference, 1, Moves::nothing);
  job.sampling.reference_samples = 8;
  expect_truth(job);
}

/// Rounds and sweeps, whose scatter tells the noise of what is seen: over seeds that choose the
/// sites, too. Standard errors are below 1 %. Where there are no edges it is within 15 %; of a
/// lens, whose points are stratified, too, within 35 %. A box
/// before black, whose noise is nearly all that of edges, is told too large, since sites are
/// stratified over the rounds, and never too small.
struct Scatter {
  Method method;
  int sites, rounds, sweeps;
  bool lens;
};
class ToldNoiseByScatter : public testing::TestWithParam<Scatter> {};
TEST_P(ToldNoiseByScatter, IsTrue) {
  const Scatter& of = GetParam();
  for (const bool has_edges : {false, true}) {
    JobSpec job = noise_job(of.method, of.sites, Moves::light);
    if (!has_edges) {
      job.image.width = 24;
      job.image.height = 16;
      job.camera = {
          .position = {-1.5f, 2, 1}, .look_at = {-0.75f, 0, -1.2f}, .vertical_fov_deg = 1};
    }
    job.image.site_seed = 0;
    job.quality.rounds = of.rounds;
    job.quality.sweeps = of.sweeps;
    if (of.lens) job.camera.aperture = 0.2f;
    expect_truth(job, 0.85, has_edges ? 1.8 : of.lens ? 1.35 : 1.15);
  }
}
INSTANTIATE_TEST_SUITE_P(
    Kinds, ToldNoiseByScatter,
    testing::Values(Scatter{Method::pool, 1, 2, 1, false}, Scatter{Method::pool, 4, 3, 1, false},
                    Scatter{Method::pool, 1, 4, 1, true}, Scatter{Method::pool, 4, 1, 3, false},
                    Scatter{Method::pool, 1, 2, 2, false}, Scatter{Method::mis, 4, 2, 1, false},
                    Scatter{Method::bidirectional, 1, 4, 1, false}));

// Another draw from the samples that are carried would be as wrong as they are.
TEST(ToldNoiseOf, CarriedSamplesIsNotTold) {
  for (const Method method : {Method::sequential, Method::restir}) {
    const FilmTile film = test::render_tile(noise_job(method, 1, Moves::light)).films.back();
    EXPECT_EQ(film.find(kErrorChannel), nullptr);
    EXPECT_FALSE(noise_of_film(film).is_told());
  }
}

// Pixels without a surface have no part in it.
TEST(ToldNoiseOf, ProbesOneInSoMany) {
  const FilmTile film = test::render_tile(noise_job(Method::pool, 1, Moves::nothing)).films.back();
  const auto error = test::channel(film, kErrorChannel), alpha = test::channel(film, "A");
  std::size_t probes = 0, surfaces = 0;
  for (std::size_t i = 0; i < error.size(); ++i) {
    EXPECT_EQ(error[i] == kNoSurface, alpha[i] == 0);
    surfaces += alpha[i] > 0 ? 1 : 0;
    probes += error[i] >= 0 ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(surfaces) / static_cast<double>(probes), 128, 20);
}

}  // namespace
}  // namespace baton
