#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/support/leave_pictures.h"
#include "tests/support/moments.h"
#include "tests/support/small_scene.h"

/// Estimators against brute force. Runs (seeds) are independent; pixels and frames of one run are
/// not, so all statistics are taken over runs.
namespace baton::test {

/// Per-pixel means and squared standard errors of an estimator.
struct Estimate {
  std::vector<double> mean, variance;
  double image_mean = 0, image_variance = 0;
};

/// Means over runs of values of theirs. values_of: of a run, from 1.
inline Estimate estimate_over(int runs,
                              const std::function<std::vector<double>(std::uint64_t)>& values_of) {
  std::vector<Moments> pixels;
  Moments image;
  for (int run = 1; run <= runs; ++run) {
    const std::vector<double> values = values_of(static_cast<std::uint64_t>(run));
    pixels.resize(values.size());
    double mean = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      pixels[i].add(values[i]);
      mean += values[i] / static_cast<double>(values.size());
    }
    image.add(mean);
  }
  Estimate e{.mean = {},
             .variance = {},
             .image_mean = image.mean(),
             .image_variance = image.variance_of_mean()};
  for (const Moments& pixel : pixels) {
    e.mean.push_back(pixel.mean());
    e.variance.push_back(pixel.variance_of_mean());
  }
  return e;
}

/// The last frame of `job` over independent seeds: the mean of R, G and B, or other values of it.
inline Estimate repeat(
    JobSpec job, int runs,
    const std::function<std::vector<double>(const FilmTile&)>& values_of =
        [](const FilmTile& film) { return mean_rgb(film); }) {
  return estimate_over(runs, [&](std::uint64_t seed) {
    job.seed = seed;
    return values_of(render_tile(job).films.back());
  });
}

/// Leaves the last frame alone.
inline void keep_last_frame(JobSpec& job) { job.frames = {job.frames.back()}; }

/// The last frame by brute force, with its own standard errors.
inline Estimate judge(JobSpec job, int samples) {
  job.sampling.method = Method::reference;
  job.sampling.reference_samples = samples;
  job.output.aovs = {Aov::variance};
  keep_last_frame(job);
  job.seed = 99991;
  const FilmTile film = render_tile(job).films.back();
  Estimate e;
  e.mean = mean_rgb(film);
  // No less than the variance of the mean of the channels.
  const std::vector<double> variance = mean_rgb(film, "variance");
  const auto n = static_cast<double>(e.mean.size());
  for (std::size_t i = 0; i < e.mean.size(); ++i) {
    e.variance.push_back(variance[i]);
    e.image_mean += e.mean[i] / n;
    e.image_variance += variance[i] / (n * n);
  }
  return e;
}

/// A bias of so many standard errors of the image mean would have shown.
inline constexpr double kResolvedErrors = 3.9;

/// What the comparison found: the largest |z| of any pixel and that of the image mean.
struct Verdict {
  double worst_pixel = 0, image = 0;
  /// Smallest relative bias of the image mean that would have shown.
  double resolution = 0;
};
inline Verdict compare(const Estimate& a, const Estimate& b) {
  Verdict v;
  for (std::size_t i = 0; i < a.mean.size(); ++i) {
    // Float rounding of the film itself is the floor of what can be told apart.
    const double floor = 1e-6 * b.mean[i] * b.mean[i];
    v.worst_pixel = std::max(v.worst_pixel, std::fabs(a.mean[i] - b.mean[i]) /
                                                std::sqrt(a.variance[i] + b.variance[i] + floor));
  }
  const double error = std::sqrt(a.image_variance + b.image_variance);
  v.image = std::fabs(a.image_mean - b.image_mean) / error;
  v.resolution = kResolvedErrors * error / b.image_mean;
  return v;
}

// Level 1e-3 per comparison. 108 pixels with Sidak: 9.3e-6 two-sided per pixel, which for the t
// distribution of 47 degrees of freedom is |t| = 5.0; the reference's share of the error only
// lightens the tail. Image mean: |z| = 3.5.
inline constexpr double kPixelLimit = 5.0;
inline constexpr double kImageLimit = 3.5;

inline void expect_agreement(const JobSpec& job, int runs, double max_resolution) {
  const Estimate seen = repeat(job, runs), truth = judge(job, 60000);
  const Verdict v = compare(seen, truth);
  EXPECT_LT(v.worst_pixel, kPixelLimit);
  EXPECT_LT(v.image, kImageLimit);
  if (v.worst_pixel >= kPixelLimit || v.image >= kImageLimit)
    leave_pictures(job.image.width, seen.mean, truth.mean);
  EXPECT_LT(v.resolution, max_resolution);
  std::printf("  image |z| %.2f, worst pixel |z| %.2f, resolves a bias of %.2f %%\n", v.image,
              v.worst_pixel, 100 * v.resolution);
}

}  // namespace baton::test
