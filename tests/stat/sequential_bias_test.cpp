// What [Ghosh, Doucet & Heidrich 2006] claim of the ratio form, through many frames: with no
// refresh and no change of support the carried Lns and the image have the right expectation. Runs
// (seeds) are independent; all statistics are over runs.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "tests/support/small_scene.h"

namespace baton {
namespace {

using test::channel;
using test::mean_rgb;

constexpr std::array<std::size_t, 3> kFrames{1, 5, 20};

/// Image means of Lns and of the radiance at kFrames.
struct ImageMeans {
  std::array<double, 3> lns{}, radiance{};
};

double mean_of(std::span<const float> values) {
  double sum = 0;
  for (const float v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

ImageMeans means_of(const std::vector<FilmTile>& films, const std::array<std::size_t, 3>& frames) {
  ImageMeans means;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FilmTile& film = films[frames[i] - 1];
    means.lns[i] = mean_of(channel(film, "lns"));
    for (const double value : mean_rgb(film))
      means.radiance[i] += value / static_cast<double>(film.num_pixels());
  }
  return means;
}

/// Mean and squared standard error over runs of each of the six numbers.
struct Estimates {
  std::array<double, 6> sum{}, squares{};
  int runs = 0;

  void add(const ImageMeans& means) {
    for (std::size_t i = 0; i < 3; ++i) {
      put(i, means.lns[i]);
      put(3 + i, means.radiance[i]);
    }
    ++runs;
  }
  double mean(std::size_t i) const { return sum[i] / runs; }
  double variance(std::size_t i) const {
    return (squares[i] / runs - mean(i) * mean(i)) / (runs - 1);
  }

 private:
  void put(std::size_t i, double value) {
    sum[i] += value;
    squares[i] += value * value;
  }
};

/// 16 x 12 pixels, 20 frames of a sky that turns slowly; transparent, so that only sampled light
/// counts.
JobSpec turning_job() {
  JobSpec job = test::box_job();
  job.image.width = 16;
  job.image.height = 12;
  job.frames = test::frame_numbers(20);
  job.output.background = Background::transparent;
  job.output.aovs = {Aov::lns};
  job.environment.rotation_deg_per_frame = 0.3;
  job.environment.keys[0].map = test::write_map("soft.exr", test::sky_map(32, 16, 10));
  job.sampling.num_candidates = 128;
  job.sampling.refresh_every = 0;
  return job;
}

Estimates carried(JobSpec job, int runs) {
  Estimates estimates;
  for (int run = 1; run <= runs; ++run) {
    job.seed = static_cast<std::uint64_t>(run);
    estimates.add(means_of(test::render_tile(job).films, kFrames));
  }
  return estimates;
}

/// Brute force at the same frames; its error, too, is measured over runs.
Estimates truth(const JobSpec& sequence) {
  Estimates estimates;
  for (int run = 0; run < 12; ++run) {
    ImageMeans means;
    for (std::size_t i = 0; i < kFrames.size(); ++i) {
      // One frame, turned as far as the sequence has turned there.
      JobSpec job = sequence;
      job.sampling.method = Method::reference;
      job.sampling.reference_samples = 4096;
      job.frames = {FrameNumber(1)};
      job.environment.rotation_start_deg = 0.3 * static_cast<double>(kFrames[i] - 1);
      job.seed = static_cast<std::uint64_t>(90001 + run);
      const ImageMeans one = means_of(test::render_tile(job).films, {1, 1, 1});
      means.lns[i] = one.lns[0];
      means.radiance[i] = one.radiance[0];
    }
    estimates.add(means);
  }
  return estimates;
}

/// Largest |z| of the six comparisons, and the smallest relative bias that the coarsest could have
/// seen.
struct Verdict {
  double worst = 0, resolution = 0;
};
/// 1e-3 for six comparisons together (Sidak): 1.67e-4 each, |t| of 239 degrees of freedom. The
/// reference's errors are far smaller.
constexpr double kLimit = 3.82;

Verdict compare(const Estimates& a, const Estimates& b) {
  Verdict verdict;
  for (std::size_t i = 0; i < 6; ++i) {
    const double error = std::sqrt(a.variance(i) + b.variance(i));
    const double z = (a.mean(i) - b.mean(i)) / error;
    std::printf("  %s at frame %2zu: %+.3f %% (z %+.2f), a bias of %.2f %% would have been seen\n",
                i < 3 ? "Lns     " : "radiance", kFrames[i % 3], 100 * (a.mean(i) / b.mean(i) - 1),
                z, 100 * kLimit * error / b.mean(i));
    verdict.worst = std::max(verdict.worst, std::fabs(z));
    verdict.resolution = std::max(verdict.resolution, kLimit * error / b.mean(i));
  }
  return verdict;
}

// Hypothesis: E[Lns^_n] and the mean image are the truth at frames 1, 5 and 20. 240 runs, seeds 1
// to 240.
TEST(SequentialBias, RatioFormIsUnbiasedThroughTwentyFrames) {
  const JobSpec job = turning_job();
  const Verdict verdict = compare(carried(job, 240), truth(job));
  EXPECT_LT(verdict.worst, kLimit);
  EXPECT_LT(verdict.resolution, 0.01);
}

// The same machinery must see what is biased: a left sum over one distribution loses J / 2 of log
// Lns in each frame.
TEST(SequentialBias, ALeftPathSumIsSeenToBeBiased) {
  JobSpec job = turning_job();
  job.sampling.lns_update = LnsUpdate::path_left;
  job.sampling.num_distributions = 1;
  const Verdict verdict = compare(carried(job, 60), truth(job));
  EXPECT_GT(verdict.worst, kLimit);
}

}  // namespace
}  // namespace baton
