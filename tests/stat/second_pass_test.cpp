// Both passes on a rendered scene against brute force. Runs (seeds) are independent, so all
// statistics are taken over runs.
#include <gtest/gtest.h>

#include <cmath>

#include "common/job/text/frame_range.h"
#include "tests/support/second_pass.h"

namespace baton {
namespace {

using test::correlated_job;

constexpr int kRuns = 64;

struct Estimate {
  std::vector<double> mean, variance;  ///< (pixels) and squared standard errors
};

/// Pixels of the last frame over independent seeds, relative to their own truth only where asked.
Estimate repeat(const JobSpec& job, int runs) {
  auto loaded = load_render_context(job, Digest{1, 2});
  EXPECT_TRUE(loaded.ok());
  std::vector<double> sum, squares;
  for (int run = 1; run <= runs; ++run) {
    JobSpec seeded = job;
    seeded.seed = static_cast<std::uint64_t>(run);
    const std::vector<double> pixels = test::mean_rgb(test::render_correlated(seeded).film);
    sum.resize(pixels.size());
    squares.resize(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      sum[i] += pixels[i];
      squares[i] += pixels[i] * pixels[i];
    }
  }
  Estimate e;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    const double m = sum[i] / runs;
    e.mean.push_back(m);
    e.variance.push_back(std::max(squares[i] / runs - m * m, 0.0) / (runs - 1));
  }
  return e;
}

/// Brute force with its own standard errors.
Estimate judge(JobSpec job) {
  job.visibility.correlated = false;
  job.sampling.method = Method::reference;
  job.sampling.reference_samples = 60000;
  job.output.aovs = {Aov::variance};
  job.frames = {job.frames.back()};
  job.seed = 99991;
  const FilmTile film = test::render_tile(job).films.back();
  Estimate e{test::mean_rgb(film), {}};
  e.variance = test::mean_rgb(film, "variance");  // no less than that of the channels' mean
  return e;
}

/// Largest |z| of any pixel.
double worst_z(const Estimate& a, const Estimate& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.mean.size(); ++i) {
    const double floor = 1e-6 * b.mean[i] * b.mean[i];
    worst = std::max(
        worst, std::fabs(a.mean[i] - b.mean[i]) / std::sqrt(a.variance[i] + b.variance[i] + floor));
  }
  return worst;
}

// Level 1e-3 for a comparison of 108 pixels [Sidak], t distribution of 63 degrees of freedom.
constexpr double kLimit = 4.9;

/// The seed must not move the sites: one site looks through the pixel's centre.
JobSpec still_job(SecondPassForm form, MaskPolicy mask, Method method = Method::bidirectional) {
  JobSpec job = correlated_job(method);
  job.visibility.form = form;
  job.visibility.mask = mask;
  job.sampling.num_candidates = 256;
  return job;
}

void expect_agreement(const JobSpec& job, int runs = kRuns) {
  const double z = worst_z(repeat(job, runs), judge(job));
  std::printf("  worst pixel |z| %.2f\n", z);
  EXPECT_LT(z, kLimit);
}

TEST(SecondPassStat, CorrectedCrossFoldAgreesWithBruteForce) {
  expect_agreement(still_job(SecondPassForm::corrected, MaskPolicy::cross_fold));
}
TEST(SecondPassStat, CorrectedSplitAgreesWithBruteForce) {
  expect_agreement(still_job(SecondPassForm::corrected, MaskPolicy::split));
}
TEST(SecondPassStat, DilatedMasksAgreeWithBruteForce) {
  JobSpec job = still_job(SecondPassForm::corrected, MaskPolicy::cross_fold, Method::mis);
  job.visibility.dilate = 1;
  expect_agreement(job);
}
TEST(SecondPassStat, ExtraSamplesAgreeWithBruteForce) {
  JobSpec job = still_job(SecondPassForm::extra_samples, MaskPolicy::cross_fold);
  job.visibility.partitions = 3;
  expect_agreement(job);
}
// Two instances of one mesh, one of them moving, before a moving camera.
TEST(SecondPassStat, MovingInstancesAgreeWithBruteForce) {
  JobSpec job = still_job(SecondPassForm::corrected, MaskPolicy::cross_fold);
  job.frames = test::frame_numbers(3);
  test::set_in_motion(job, true, true);
  job.frames = parse_frames("2-3").value();
  expect_agreement(job);
}
TEST(SecondPassStat, SequentialPopulationsAgreeWithBruteForce) {
  JobSpec job = still_job(SecondPassForm::corrected, MaskPolicy::cross_fold, Method::sequential);
  job.frames = test::frame_numbers(3);
  job.environment.rotation_deg_per_frame = 0.3;
  expect_agreement(job);
}
TEST(SecondPassStat, CoatedSurfacesAgreeWithBruteForce) {
  JobSpec job = still_job(SecondPassForm::corrected, MaskPolicy::cross_fold);
  for (const char* const name : {"ground", "metal"}) {
    MaterialSpec& material = job.scene.materials[name];
    material.kind = MaterialKind::metallic_roughness;
    material.clearcoat = 0.8f;
    material.clearcoat_roughness = 0.5f;
  }
  expect_agreement(job, 4 * kRuns);
}
// The machinery that finds nothing above finds the published form.
TEST(SecondPassStat, PublishedIsSeenToBeBiased) {
  for (const SecondPassForm form : {SecondPassForm::published, SecondPassForm::published_kept}) {
    const JobSpec job = still_job(form, MaskPolicy::cross_fold);
    EXPECT_GT(worst_z(repeat(job, kRuns), judge(job)), 2 * kLimit);
  }
}

}  // namespace
}  // namespace baton
