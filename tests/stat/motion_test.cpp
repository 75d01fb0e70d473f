// The samplers that carry through motion against brute force. `sequential` in its ratio form and
// without refresh, so that nothing mends an error: the scene is of flat faces, whose horizons
// motion does not change: what was in the dark stays there (METHODS of the paper: unbiased as long
// as the support does not change). Hypothesis: per-pixel and image means of the last frame are
// those of brute force; level 1e-3 each, Sidak over the pixels.
#include <gtest/gtest.h>

#include <array>
#include <functional>

#include "tests/stat/against_brute_force.h"
#include "tests/support/alive_box.h"
#include "worker/method/carried/old_surfaces.h"

namespace baton {
namespace {

JobSpec moving_job(bool camera, bool object, int sites) {
  JobSpec job = test::box_job();
  job.frames = test::frame_numbers(5);
  job.image.sites = sites;
  job.environment.rotation_deg_per_frame = 0.3;
  job.sampling.method = Method::sequential;
  job.sampling.num_candidates = 256;
  job.sampling.refresh_every = 0;
  test::set_in_motion(job, camera, object);
  return job;
}

constexpr int kMotionRuns = 128;

TEST(Motion, AMovingCameraIsUnbiased) {
  test::expect_agreement(moving_job(true, false, 1), kMotionRuns, 0.02);
}
TEST(Motion, AMovingObjectIsUnbiased) {
  test::expect_agreement(moving_job(false, true, 1), kMotionRuns, 0.02);
}

/// A box that grows: its faces stay flat and turned as they are, its points slide along.
JobSpec growing_job() {
  JobSpec job = moving_job(false, false, 1);
  test::set_deforming(job, 0, 0.4f);
  return job;
}
TEST(Motion, AGrowingBoxIsUnbiased) { test::expect_agreement(growing_job(), kMotionRuns, 0.02); }

/// Both sides average over the sites, which are part of the seed.
void expect_agreement_over_sites(const JobSpec& job) {
  JobSpec reference = job;
  reference.sampling.method = Method::reference;
  reference.sampling.reference_samples = 1000;
  test::keep_last_frame(reference);
  const test::Verdict v = test::compare(test::repeat(job, 192), test::repeat(reference, 192));
  EXPECT_LT(v.worst_pixel, test::kPixelLimit);
  EXPECT_LT(v.image, test::kImageLimit);
  EXPECT_LT(v.resolution, 0.02);
  std::printf("  image |z| %.2f, worst pixel |z| %.2f, resolves a bias of %.2f %%\n", v.image,
              v.worst_pixel, 100 * v.resolution);
}

TEST(Motion, BothAreUnbiasedWithSeveralSites) {
  expect_agreement_over_sites(moving_job(true, true, 4));
}

/// The memory of the pool's pixels follows the surfaces; the second box is also a shadow that
/// moves.
JobSpec moving_pool_job(bool camera, bool object, int sites) {
  JobSpec job = moving_job(camera, object, sites);
  job.sampling.method = Method::pool;
  job.sampling.num_candidates = 64;
  job.environment.rotation_deg_per_frame = 1.5;
  return job;
}
TEST(Motion, ThePoolIsUnbiasedUnderAMovingCamera) {
  test::expect_agreement(moving_pool_job(true, false, 1), 200, 0.003);
}
TEST(Motion, ThePoolIsUnbiasedUnderAMovingOccluder) {
  test::expect_agreement(moving_pool_job(false, true, 1), 200, 0.003);
}
TEST(Motion, ThePoolIsUnbiasedUnderBothWithSeveralSites) {
  expect_agreement_over_sites(moving_pool_job(true, true, 4));
}

/// A box that bends by 8 degrees a frame while it grows, under a camera that moves.
JobSpec bending_job(Method method, int sites) {
  JobSpec job = moving_pool_job(true, false, sites);
  test::set_deforming(job, 40 * kPi / 180, 0.3f);
  job.sampling.method = method;
  return job;
}
TEST(Motion, ThePoolIsUnbiasedOnABoxThatBends) {
  test::expect_agreement(bending_job(Method::pool, 1), 200, 0.003);
}

/// ReSTIR, whose neighbours are asked around the place that the pixel comes from.
JobSpec moving_restir_job(bool camera, bool object, int sites, int neighbors) {
  JobSpec job = moving_pool_job(camera, object, sites);
  job.sampling.method = Method::restir;
  job.sampling.num_neighbors = neighbors;
  job.sampling.neighbor_radius = 4;
  return job;
}
TEST(Motion, RestirIsUnbiasedUnderAMovingCamera) {
  test::expect_agreement(moving_restir_job(true, false, 1, 0), kMotionRuns, 0.01);
}
TEST(Motion, RestirIsUnbiasedUnderAMovingObjectWithNeighbors) {
  test::expect_agreement(moving_restir_job(false, true, 1, 2), kMotionRuns, 0.01);
}
TEST(Motion, RestirIsUnbiasedOnABoxThatBends) {
  JobSpec job = bending_job(Method::restir, 4);
  job.sampling.num_neighbors = 1;
  job.sampling.neighbor_radius = 4;
  expect_agreement_over_sites(job);
}
TEST(Motion, RestirIsUnbiasedUnderBothWithSeveralSites) {
  expect_agreement_over_sites(moving_restir_job(true, true, 4, 1));
}

/// Mean of Lns over runs and its squared standard error.
struct LnsMean {
  double mean = 0, variance = 0;
};

/// A glossy surface whose viewer turns by 20 degrees from one frame to the next; the horizon stays.
class TurningViewer {
 public:
  TurningViewer()
      : job_(moving_job(true, false, 1)), context_(*load_render_context(job_, Digest{1, 2})) {
    light_ = *context_->lights->at(Step(0));
    const Material glossy = make_material(job_.scene.materials.at("glossy"));
    const Vec3 up{0, 1, 0};
    sites_.clear(1);
    sites_.add(0, {.position = {}, .ng = up, .ns = up, .wo = normalize({0.1f, 1, 0.6f})}, glossy);
    old_.sites.clear(1);
    old_.sites.add(0, {.position = {}, .ng = up, .ns = up, .wo = normalize({0.1f, 1, 0.1f})},
                   glossy);
  }

  LnsMean carried(bool told_of_the_old_surface) {
    return over_runs([&](const RngKey& key) {
      sample(old_.sites, nullptr, false, key);
      RngKey next = key;
      next.frame = 2;
      const float lns = sample(sites_, told_of_the_old_surface ? &old_ : nullptr, true, next);
      EXPECT_EQ(state_.source[0], PixelSource::carried);
      return lns;
    });
  }
  LnsMean fresh() {
    return over_runs([&](const RngKey& key) { return sample(sites_, nullptr, false, key); });
  }

 private:
  /// Lns.
  float sample(const SiteBlock& sites, const OldSurfaces* old, bool has_history,
               const RngKey& key) {
    const RoundLight light{*light_};
    RayBatch batch;
    const SiteOrigins origins{};
    RayWriter rays(origins, batch);
    sampler_->begin_round(state_, false);
    return sampler_
        ->sample({.sites = sites,
                  .light = light,
                  .presampled = light_->presampled->sets.front(),
                  .key = key,
                  .rounds_before = 1,
                  .start = {.has_history = has_history, .old = old}},
                 {state_, 0}, rays)
        .lns;
  }
  LnsMean over_runs(const std::function<float(const RngKey&)>& estimate) {
    constexpr int kRuns = 3000;
    double sum = 0, squares = 0;
    for (int run = 1; run <= kRuns; ++run) {
      state_.resize(*context_->method.format, {0, 0, 1, 1}, 16);
      const double lns =
          estimate({.job_seed = static_cast<std::uint64_t>(run), .frame = 1, .pixel = 1});
      sum += lns;
      squares += lns * lns;
    }
    const double mean = sum / kRuns;
    return {mean, (squares / kRuns - mean * mean) / (kRuns - 1)};
  }

  JobSpec job_;
  std::shared_ptr<const RenderContext> context_;
  std::unique_ptr<TileSampler> sampler_ = context_->method.start();
  SampleState state_;
  std::shared_ptr<const FrameLight> light_;
  SiteBlock sites_;
  OldSurfaces old_;
};

double z_score(const LnsMean& a, const LnsMean& b) {
  return std::fabs(a.mean - b.mean) / std::sqrt(a.variance + b.variance);
}

// Runs share the frame's pool, which depends on none of their seeds; both sides use the same one,
// so its error cancels.
TEST(Motion, LnsFollowsASurfaceThatIsSeenFromElsewhere) {
  TurningViewer viewer;
  EXPECT_LT(z_score(viewer.carried(true), viewer.fresh()), test::kImageLimit);
}

// The same machinery must see samples that are carried as if the surface had stayed.
TEST(Motion, PlantedFaultIsSeen) {
  TurningViewer viewer;
  EXPECT_GT(z_score(viewer.carried(false), viewer.fresh()), 2 * test::kImageLimit);
}

}  // namespace
}  // namespace baton
