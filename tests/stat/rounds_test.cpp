// Frames of several rounds, and pixel filters, against brute force. Sites are part of the seed:
// both sides average over them, with 96 seeds each. Level 1e-3 for all pixels of a comparison
// (Sidak) and for the mean of the picture.
#include <gtest/gtest.h>

#include "tests/stat/sites_study.h"
#include "worker/pass/primary.h"
#include "worker/sampling/pixel_filter.h"

namespace baton {
namespace {

using test::box_job;
using test::compare;
using test::Estimate;
using test::kImageLimit;
using test::kPixelLimit;
using test::repeat;
using test::Verdict;

constexpr int kRuns = 96;

JobSpec rounds_job(Method method, int frames, bool in_motion) {
  JobSpec job = box_job();
  job.frames = test::frame_numbers(frames);
  job.image.sites = 4;
  job.environment.rotation_deg_per_frame = 0.3;
  job.sampling.method = method;
  job.sampling.num_candidates = 64;
  job.sampling.num_particles = 8;
  job.quality.rounds = 4;
  if (in_motion) test::set_in_motion(job, true, true);
  return job;
}

JobSpec judge_of(JobSpec job) {
  job.sampling.method = Method::reference;
  job.sampling.reference_samples = 128;
  // Whatever their number, sites have the same mean; several are less noisy.
  job.image.sites = std::max(job.image.sites, 4);
  job.image.max_sites = 0;
  test::keep_last_frame(job);
  return job;
}

void expect_agreement(const JobSpec& job, double resolution) {
  const Verdict v = compare(repeat(job, kRuns), repeat(judge_of(job), kRuns));
  EXPECT_LT(v.worst_pixel, kPixelLimit);
  EXPECT_LT(v.image, kImageLimit);
  EXPECT_LT(v.resolution, resolution);
  std::printf("  image |z| %.2f, worst pixel |z| %.2f, resolves a bias of %.2f %%\n", v.image,
              v.worst_pixel, 100 * v.resolution);
}

// Rounds of every method, with any number of sites, at one size for all.
void expect_agreement_of_all(bool in_motion) {
  test::study_sites(in_motion, {.runs = kRuns, .rounds = 4}, [](const test::StudyRow& row) {
    const Verdict& v = row.verdict;
    SCOPED_TRACE(std::string(traits(row.method).name) + ", sites: " + std::to_string(row.sites));
    EXPECT_LT(v.worst_pixel, kPixelLimit);
    EXPECT_LT(v.image, kImageLimit);
    EXPECT_LT(v.resolution, 0.006);
    std::printf("  %-14s %2d sites: image |z| %.2f, worst pixel |z| %.2f, resolves %.2f %%\n",
                std::string(traits(row.method).name).c_str(), row.sites, v.image, v.worst_pixel,
                100 * v.resolution);
  });
}

TEST(Rounds, OfAllMethodsAgreeWithBruteForce) { expect_agreement_of_all(false); }
TEST(Rounds, OfAllMethodsAgreeInMotion) { expect_agreement_of_all(true); }

/// Six rounds or fewer after two that judge, with the noise of two rays a round.
JobSpec adaptive_job(Method method, int frames, bool in_motion) {
  JobSpec job = rounds_job(method, frames, in_motion);
  job.sampling.num_particles = 2;
  job.quality.rounds = 8;
  job.quality.adaptive_threshold = 0.1f;
  return job;
}

TEST(Rounds, AdaptiveOnesOfBidirectionalAgreeWithBruteForce) {
  expect_agreement(adaptive_job(Method::bidirectional, 1, false), 0.02);
}
TEST(Rounds, AdaptiveOnesOfThePoolAgreeWithBruteForce) {
  expect_agreement(adaptive_job(Method::pool, 3, false), 0.02);
}
TEST(Rounds, AdaptiveOnesAgreeInMotion) {
  expect_agreement(adaptive_job(Method::pool, 3, true), 0.02);
}

/// A frame of 16 rounds of each pixel that stopped after four where their scatter is small: what
/// adaptive renderers do, and a bias. The four are the first of the sixteen.
Estimate repeat_with_stopping(JobSpec job) {
  return test::estimate_over(kRuns, [&](std::uint64_t seed) {
    job.seed = seed;
    job.quality.rounds = 4;
    job.output.aovs = {Aov::variance};
    const FilmTile few = test::render_tile(job).films.back();
    job.quality.rounds = 16;
    std::vector<double> values = test::mean_rgb(test::render_tile(job).films.back());
    const std::vector<double> first = test::mean_rgb(few);
    const std::vector<double> variance = test::mean_rgb(few, "variance");
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::sqrt(variance[i]) < 0.05 * first[i]) values[i] = first[i];
    }
    return values;
  });
}

// The same machinery must see it.
TEST(Rounds, AStoppingRuleIsSeen) {
  JobSpec job = rounds_job(Method::bidirectional, 1, false);
  job.sampling.num_particles = 2;
  const Verdict v = compare(repeat_with_stopping(job), repeat(judge_of(job), kRuns));
  std::printf("  image |z| %.2f, worst pixel |z| %.2f\n", v.image, v.worst_pixel);
  EXPECT_GT(std::max(v.image / kImageLimit, v.worst_pixel / kPixelLimit), 1);
}

/// Black boxes before the sky: what a pixel shows is a function of its sites alone.
JobSpec silhouettes(PixelFilter filter) {
  JobSpec job = box_job();
  for (auto& [name, material] : job.scene.materials)
    material = {.kind = MaterialKind::diffuse, .base_color = {0, 0, 0}};
  job.scene.ground.reset();
  job.camera.look_at = {0, 0.6f, 0};
  job.sampling.method = Method::environment;
  job.sampling.num_particles = job.sampling.num_candidates = 1;
  job.image.sites = 4;
  job.image.filter = filter;
  job.quality.rounds = 16;
  return job;
}

/// The same by brute force: the picture, ray by ray, on a fine grid, weighted by the filter.
std::vector<double> filtered_by_hand(const JobSpec& job) {
  constexpr int kGrid = 24;  ///< rays a pixel along either axis
  const auto context = *load_render_context(job, Digest{1, 2});
  const auto geometry = *context->geometry->at(Step(0));
  const auto light = *context->lights->at(Step(0));
  const double radius = filter_radius(job.image.filter);
  const int reach = static_cast<int>(std::ceil((radius - 0.5) * kGrid)) + kGrid;
  std::vector<double> pixels;
  for (int y = 0; y < job.image.height; ++y) {
    for (int x = 0; x < job.image.width; ++x) {
      std::vector<Ray> rays;
      std::vector<double> weights;
      double sum = 0;
      for (int j = -reach; j < reach + kGrid; ++j) {
        for (int i = -reach; i < reach + kGrid; ++i) {
          const double px = (i + 0.5) / kGrid, py = (j + 0.5) / kGrid;
          const double weight =
              filter_weight(job.image.filter, px - 0.5) * filter_weight(job.image.filter, py - 0.5);
          if (!(weight > 0)) continue;
          rays.push_back(
              geometry->pose.camera.ray(static_cast<float>(x + px), static_cast<float>(y + py)));
          weights.push_back(weight);
          sum += weight;
        }
      }
      std::vector<SurfaceHit> hits(rays.size());
      geometry->accel->intersect(rays, hits, 1);
      double shown = 0;
      for (std::size_t r = 0; r < rays.size(); ++r) {
        if (hits[r].hit) continue;
        const auto texel = light->now.evaluate(rays[r].direction);
        shown += weights[r] / sum * (double{texel.r} + double{texel.g} + double{texel.b}) / 3;
      }
      pixels.push_back(shown);
    }
  }
  return pixels;
}

Verdict filter_verdict(PixelFilter rendered, PixelFilter judged) {
  const Estimate seen = repeat(silhouettes(rendered), 96);
  Estimate exact;
  exact.mean = filtered_by_hand(silhouettes(judged));
  exact.variance.assign(exact.mean.size(), 1e-6);  // of the grid: an edge falls between its rays
  for (const double pixel : exact.mean)
    exact.image_mean += pixel / static_cast<double>(exact.mean.size());
  exact.image_variance = 1e-8;
  return compare(seen, exact);
}

// Hypothesis: the mean of a pixel over sites, rounds and 96 seeds is the picture convolved with the
// filter, within the error of its brute-force integral.
TEST(PixelFilters, AgreeWithBruteForce) {
  for (const PixelFilter filter :
       {PixelFilter::box, PixelFilter::gaussian, PixelFilter::blackman_harris}) {
    const Verdict v = filter_verdict(filter, filter);
    std::printf("  image |z| %.2f, worst pixel |z| %.2f\n", v.image, v.worst_pixel);
    EXPECT_LT(v.worst_pixel, kPixelLimit) << static_cast<int>(filter);
    EXPECT_LT(v.image, kImageLimit) << static_cast<int>(filter);
  }
}
TEST(PixelFilters, AnotherOneIsSeen) {
  EXPECT_GT(filter_verdict(PixelFilter::box, PixelFilter::blackman_harris).worst_pixel,
            2 * kPixelLimit);
}

}  // namespace
}  // namespace baton
