// The AOV `variance` against what is seen over seeds.
//
// Hypothesis: the mean over seeds of the stated variance of a channel, summed over the pixels, is
// that of half the squared difference of two seeds at the same sites. Of 96 pairs of seeds both
// are known pair by pair, so that a t test of their difference needs no other error. Level 1e-3 for
// all 45 comparisons of this file (Sidak): |t| of 95 degrees of freedom below 4.5.
#include <gtest/gtest.h>

#include "common/job/text/frame_range.h"
#include "tests/support/small_scene.h"

namespace baton {
namespace {

constexpr int kPairs = 96;
constexpr double kLimit = 4.5;

JobSpec variance_job(Method method, int rounds) {
  JobSpec job = test::box_job();
  job.frames = parse_frames("1-2").value();
  job.image.sites = 4;
  job.image.site_seed = 5;
  job.environment.rotation_deg_per_frame = 3;
  job.sampling.method = method;
  job.sampling.num_particles = 8;
  job.sampling.num_candidates = 64;
  job.sampling.reference_samples = 16;
  job.quality.rounds = rounds;
  job.output.aovs = {Aov::variance};
  job.output.background = Background::transparent;
  return job;
}

/// Only the ground, partly in shadow, and nearly the same at all sites of a pixel: rounds have
/// sites of their own, and the scatter between these is no noise of the seed.
void look_at_the_ground(JobSpec& job) {
  job.camera = {.position = {-1.5f, 2, 1}, .look_at = {-0.75f, 0, -1.2f}, .vertical_fov_deg = 1};
}

/// The last step.
FilmTile render(JobSpec job, int seed) {
  job.seed = static_cast<std::uint64_t>(seed);
  return test::render_tile(job).films.back();
}

double sum(const FilmTile& film, const std::string& channel) {
  double sum = 0;
  for (const float v : test::channel(film, channel)) sum += double{v};
  return sum;
}

/// most: of the bias that could have been missed, as a share of the variance.
void expect_truth(const JobSpec& job, double most) {
  std::array<double, 3> seen{}, difference{}, squares{};
  const std::array<std::string, 3> names{"R", "G", "B"};
  for (int pair = 0; pair < kPairs; ++pair) {
    const FilmTile a = render(job, 2 * pair + 1), b = render(job, 2 * pair + 2);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto va = test::channel(a, names[c]), vb = test::channel(b, names[c]);
      double square = 0;
      for (std::size_t i = 0; i < va.size(); ++i)
        square += (double{va[i]} - vb[i]) * (double{va[i]} - vb[i]) / 2;
      const std::string layer = "variance." + names[c];
      const double d = (sum(a, layer) + sum(b, layer)) / 2 - square;
      seen[c] += square / kPairs;
      difference[c] += d / kPairs;
      squares[c] += d * d / kPairs;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const double error = std::sqrt((squares[c] - difference[c] * difference[c]) / (kPairs - 1));
    std::printf("  %-13s %d rounds, %s: stated over seen %.3f +- %.3f\n",
                std::string(traits(job.sampling.method).name).c_str(), job.quality.rounds,
                names[c].c_str(), 1 + difference[c] / seen[c], error / seen[c]);
    EXPECT_LT(std::fabs(difference[c]) / error, kLimit) << names[c];
    EXPECT_LT(kLimit * error / seen[c], most);
  }
}

class StatedVariance : public testing::TestWithParam<Method> {};

TEST_P(StatedVariance, OfOneRoundIsTrue) { expect_truth(variance_job(GetParam(), 1), 0.3); }
TEST_P(StatedVariance, OfRoundsIsTrue) {
  for (const int rounds : {2, 5}) {
    JobSpec job = variance_job(GetParam(), rounds);
    look_at_the_ground(job);
    expect_truth(job, 0.5);
  }
}
INSTANTIATE_TEST_SUITE_P(Methods, StatedVariance,
                         testing::Values(Method::pool, Method::bidirectional, Method::ratio,
                                         Method::reference));

TEST(StatedVarianceOf, OneRoundInMotionIsTrue) {
  JobSpec job = variance_job(Method::pool, 1);
  test::set_in_motion(job, true, true);
  expect_truth(job, 0.3);
}
TEST(StatedVarianceOf, SweepsIsTrue) {
  for (const int rounds : {1, 3}) {
    JobSpec job = variance_job(Method::pool, rounds);
    look_at_the_ground(job);
    job.quality.sweeps = 3;
    expect_truth(job, 0.5);
  }
}
TEST(StatedVarianceOf, AdaptiveRoundsIsTrue) {
  for (const float threshold : {0.02f, 0.06f}) {
    JobSpec job = variance_job(Method::bidirectional, 8);
    look_at_the_ground(job);
    job.quality.adaptive_threshold = threshold;
    job.output.aovs.push_back(Aov::rounds);
    expect_truth(job, 0.5);
    std::printf("  %.2f rounds a pixel\n", sum(render(job, 1), "rounds") / 108);
  }
}

}  // namespace
}  // namespace baton
