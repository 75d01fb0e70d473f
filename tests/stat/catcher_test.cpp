// Shadows on a curved catcher beside brute force, and in the open.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/image/shadow.h"
#include "tests/support/catcher_jobs.h"
#include "tests/support/chi_square.h"
#include "worker/pass/primary.h"

namespace baton {
namespace {

using test::ball_job;
using test::channel;

constexpr const char* kChannels[] = {"shadow.R", "shadow.G", "shadow.B"};

/// The last film as frames have it.
FilmTile finished(const JobSpec& job) {
  FilmTile film = test::render_tile(job).films.back();
  finish_shadows(film);
  return film;
}

/// S / U of a point, by rays in directions of a sphere; none of the renderer's light is used.
class BruteForce {
 public:
  BruteForce(const FrameGeometry& geometry, const Environment& sky)
      : geometry_(geometry), sky_(sky) {}

  Rgb share(const SurfaceHit& hit) {
    constexpr std::uint32_t kDirections = 16384;
    std::array<double, 3> arrives{}, whole{};
    rays_.clear();
    std::vector<Rgb> light;
    for (std::uint32_t i = 0; i < kDirections; ++i) {
      const auto u = test::test_uniforms(17, i);
      const float up = (static_cast<float>(i) + u[0]) / kDirections, around = 2 * kPi * u[1];
      const float out = std::sqrt(1 - up * up);
      const Vec3 w =
          Frame(hit.point.ns).to_world({out * std::cos(around), out * std::sin(around), up});
      const EnvironmentMap::Texel texel = sky_.evaluate(w);
      light.push_back(Rgb{texel.r, texel.g, texel.b} * up);
      rays_.push(hit.ray_origin, w);
    }
    geometry_.accel->occluded(rays_);
    for (std::size_t i = 0; i < light.size(); ++i) {
      const std::array<float, 3> rgb{light[i].x, light[i].y, light[i].z};
      for (std::size_t c = 0; c < 3; ++c) {
        whole[c] += double{rgb[c]};
        if (rays_.t_far[i] > 0) arrives[c] += double{rgb[c]};
      }
    }
    return {static_cast<float>(arrives[0] / whole[0]), static_cast<float>(arrives[1] / whole[1]),
            static_cast<float>(arrives[2] / whole[2])};
  }

 private:
  const FrameGeometry& geometry_;
  const Environment& sky_;
  ShadowRays rays_;
};

/// Of the last frame, for each pixel that sees a catcher the mean over its sites on it; else -1.
std::vector<Rgb> brute_force(const JobSpec& job) {
  const auto context = load_render_context(job, Digest{1, 2}).value();
  const Step last(static_cast<std::int32_t>(job.frames.size()) - 1);
  const auto geometry = context->geometry->at(last).value();
  const auto light = context->lights->at(last).value();
  const TileSurfaces surfaces =
      trace_primary(job, *geometry, {0, 0, job.image.width, job.image.height});
  BruteForce exact(*geometry, light->now);
  std::vector<Rgb> shares;
  for (std::size_t pixel = 0; pixel < surfaces.pixels.size(); ++pixel) {
    Rgb sum;
    float count = 0;
    for (const SurfaceHit& hit : surfaces.pixel(pixel)) {
      if (!hit.is_catcher) continue;
      sum += exact.share(hit);
      ++count;
    }
    shares.push_back(count > 0 ? sum / count : Rgb{-1, -1, -1});
  }
  return shares;
}

struct Case {
  Method method;
  bool moves;
};

/// Hypothesis: the mean over seeds of each pixel and channel is that of brute force, and so is that
/// of the whole picture; t-tests, level 1e-3 for all together [Sidak 1967]. What brute force leaves
/// (its own noise, below 0.4 %) is allowed for.
void expect_unbiased(const JobSpec& job, const std::vector<Rgb>& expected, int num_seeds,
                     double tolerance) {
  std::vector<std::vector<double>> runs;  // by seed: all pixels and channels
  std::vector<double> exact;
  for (int seed = 1; seed <= num_seeds; ++seed) {
    JobSpec other = job;
    other.seed = static_cast<std::uint64_t>(seed);
    const FilmTile film = finished(other);
    runs.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) {
      const auto values = channel(film, kChannels[c]);
      for (std::size_t i = 0; i < expected.size(); ++i) {
        if (expected[i].x < 0) {
          EXPECT_EQ(values[i], 1) << "pixel " << i;
          continue;
        }
        runs.back().push_back(double{values[i]});
        const std::array<float, 3> rgb{expected[i].x, expected[i].y, expected[i].z};
        if (seed == 1) exact.push_back(double{rgb[c]});
      }
    }
  }
  ASSERT_GT(exact.size(), 100u);
  const auto test = [&](const auto& value_of, double expectation, double allowed, double level) {
    double mean = 0, squares = 0;
    for (const auto& run : runs) mean += value_of(run) / num_seeds;
    for (const auto& run : runs) squares += std::pow(value_of(run) - mean, 2);
    const double error = std::sqrt(squares / num_seeds / (num_seeds - 1));
    const double apart = std::max(std::fabs(mean - expectation) - allowed, 0.0);
    return apart == 0 || test::t_test_p_value(apart, 0, error, num_seeds - 1) > level;
  };
  const double level = test::sidak_level(5e-4, static_cast<int>(exact.size()));
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_TRUE(test([i](const auto& run) { return run[i]; }, exact[i], tolerance, level))
        << "value " << i << ", expected " << exact[i];
  }
  const auto mean_of = [](const std::vector<double>& run) {
    double sum = 0;
    for (const double value : run) sum += value / static_cast<double>(run.size());
    return sum;
  };
  EXPECT_TRUE(test(mean_of, mean_of(exact), tolerance / 4, 5e-4)) << "the picture's mean";
}

class CurvedCatcher : public testing::TestWithParam<Case> {};

TEST_P(CurvedCatcher, ShowsTheShareOfTheLightThatArrives) {
  const auto [method, moves] = GetParam();
  JobSpec job = ball_job(method, 3);
  if (moves) test::set_all_in_motion(job);
  const std::vector<Rgb> expected = brute_force(job);
  EXPECT_TRUE(std::ranges::any_of(expected, [](const Rgb& s) { return s.y > 0 && s.y < 0.6f; }));
  // Some sequences of carried samples are far off: their mean needs more of them.
  expect_unbiased(job, expected, method == Method::sequential ? 128 : 32, 0.004);
}

INSTANTIATE_TEST_SUITE_P(
    Methods, CurvedCatcher,
    testing::Values(Case{Method::pool, false}, Case{Method::pool, true},
                    Case{Method::bidirectional, false}, Case{Method::bidirectional, true},
                    Case{Method::sequential, false}, Case{Method::sequential, true},
                    Case{Method::restir, false}, Case{Method::restir, true},
                    Case{Method::mis, false}, Case{Method::environment, true},
                    Case{Method::reference, false}, Case{Method::reference, true}));

// Where nothing casts a shadow the share is 1, in all directions that the ball faces.
TEST(CatcherInTheOpen, IsNotDarkened) {
  for (const Method method : {Method::pool, Method::bidirectional, Method::sequential}) {
    JobSpec job = ball_job(method, 2);
    job.scene.objects.erase(job.scene.objects.begin(), job.scene.objects.begin() + 2);
    job.camera.look_at = {0, -1.2f, 0};
    const FilmTile film = test::render_tile(job).films.back();
    std::vector<Rgb> expected;
    for (const float share : channel(film, kCatcherChannel))
      expected.push_back(share > 0 ? Rgb{1, 1, 1} : Rgb{-1, -1, -1});
    expect_unbiased(job, expected, 32, 5e-4);
  }
}

}  // namespace
}  // namespace baton
