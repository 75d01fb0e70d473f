// The AOV `unshadowed` against brute force without any occlusion.
//
// Hypothesis: its mean over seeds, in each channel of each pixel, is the integral of the map over
// the hemisphere of each site, which is summed here over a fine grid of directions and traces no
// ray. Level 1e-3 for the 324 values of a comparison (Sidak) and for their mean; the runs are
// independent seeds at the same sites.
#include <gtest/gtest.h>

#include "tests/stat/against_brute_force.h"
#include "worker/pass/primary.h"

namespace baton {
namespace {

using test::Estimate;
using test::Verdict;

constexpr int kRuns = 64;
// The t distribution of 63 degrees of freedom at 3.1e-6, two-sided.
constexpr double kValueLimit = 5.1;

JobSpec unshadowed_job(Method method, int sites, int frames) {
  JobSpec job = test::box_job();
  job.frames = test::frame_numbers(frames);
  job.image.sites = sites;
  job.image.site_seed = 5;
  job.environment.rotation_deg_per_frame = 0.3;
  job.environment.filter = MapFilter::nearest;  // so that the grid of directions is exact
  job.sampling.method = method;
  job.sampling.num_candidates = 64;
  job.sampling.reuse_visibility = false;
  job.sampling.num_particles = 8;
  // Of 8 samples of the map few meet the sun: no sum of 64 seeds is near to normal.
  if (method == Method::environment) {
    job.sampling.num_particles = 64;
    job.environment.keys[0].map = test::write_map("soft.exr", test::sky_map(64, 32, 3));
  }
  job.sampling.reference_samples = 64;
  job.output.aovs = {Aov::unshadowed};
  return job;
}

std::vector<double> values_of(const FilmTile& film, const std::string& stem) {
  std::vector<double> values;
  for (const char* const c : {"R", "G", "B"}) {
    const auto plane = test::channel(film, stem + c);
    values.insert(values.end(), plane.begin(), plane.end());
  }
  return values;
}

Estimate stated(const JobSpec& job, const std::string& stem = "unshadowed.") {
  return test::repeat(job, kRuns, [&](const FilmTile& film) { return values_of(film, stem); });
}

/// What a site reflects of the whole map, shadows or none.
std::array<double, 3> reflected(const SeenSurface& site, const Environment& light) {
  // Each texel of 64 x 32 has 4 x 4 directions.
  constexpr int kWidth = 64 * 4, kHeight = 32 * 4;
  std::array<double, 3> sum{};
  for (int j = 0; j < kHeight; ++j) {
    const double theta = (j + 0.5) * double{kPi} / kHeight;
    const double solid_angle =
        2 * double{kPi} / kWidth * 2 * std::sin(theta) * std::sin(double{kPi} / kHeight / 2);
    for (int i = 0; i < kWidth; ++i) {
      const double phi = (i + 0.5) * 2 * double{kPi} / kWidth;
      const Vec3 in_map{static_cast<float>(std::sin(theta) * std::cos(phi)),
                        static_cast<float>(std::cos(theta)),
                        static_cast<float>(std::sin(theta) * std::sin(phi))};
      const Vec3 wi = light.rotation * in_map;
      if (!above_horizon(site.point, wi)) continue;
      const EnvironmentMap::Texel texel = light.evaluate(wi);
      if (texel.is_hidden()) continue;
      const Rgb f = evaluate_bsdf(site.material, site.point, wi);
      const double weight = solid_angle * double{dot(site.point.ns, wi)};
      sum[0] += weight * double{f.x} * double{texel.r};
      sum[1] += weight * double{f.y} * double{texel.g};
      sum[2] += weight * double{f.z} * double{texel.b};
    }
  }
  return sum;
}

/// The last frame by brute force.
Estimate without_occlusion(const JobSpec& job) {
  const auto context = *load_render_context(job, Digest{1, 2});
  const Step last(static_cast<std::int32_t>(job.frames.size()) - 1);
  const auto geometry = *context->geometry->at(last);
  const auto light = *context->lights->at(last);
  const PixelRect rect = job.image.rendered();
  const auto num_pixels = static_cast<std::size_t>(rect.area());
  const TileSurfaces surfaces = trace_primary(context->job, *geometry, rect);
  Estimate e;
  e.mean.resize(3 * num_pixels);
  e.variance.assign(e.mean.size(), 0);
  for (std::size_t pixel = 0; pixel < num_pixels; ++pixel) {
    for (std::size_t s = 0; s < static_cast<std::size_t>(job.image.sites); ++s) {
      const std::size_t at = pixel * static_cast<std::size_t>(job.image.sites) + s;
      std::array<double, 3> value{};
      if (surfaces.hits[at].hit) {
        value = reflected(geometry->see(surfaces.hits[at]), light->now);
      } else {
        const auto texel = light->now.evaluate(surfaces.rays[at].direction);
        value = {double{texel.r}, double{texel.g}, double{texel.b}};
      }
      for (std::size_t c = 0; c < 3; ++c)
        e.mean[c * num_pixels + pixel] += value[c] / job.image.sites;
    }
  }
  for (const double v : e.mean) e.image_mean += v / static_cast<double>(e.mean.size());
  return e;
}

void expect_agreement(const JobSpec& job) {
  const Estimate truth = without_occlusion(job);
  const Verdict v = compare(stated(job), truth);
  std::printf("  %-13s mean |z| %.2f, worst value |z| %.2f, resolves a bias of %.2f %%\n",
              std::string(traits(job.sampling.method).name).c_str(), v.image, v.worst_pixel,
              100 * v.resolution);
  EXPECT_LT(v.worst_pixel, kValueLimit);
  EXPECT_LT(v.image, test::kImageLimit);
  EXPECT_LT(v.resolution, 0.03);
  // The same machinery tells light with shadows from light without.
  EXPECT_GT(compare(stated(job, ""), truth).worst_pixel, 2 * kValueLimit);
}

class Unshadowed : public testing::TestWithParam<Method> {};
TEST_P(Unshadowed, IsTheLightWithoutOcclusion) {
  expect_agreement(unshadowed_job(GetParam(), 1, 1));
}
TEST_P(Unshadowed, IsItAtSeveralSites) { expect_agreement(unshadowed_job(GetParam(), 4, 3)); }
TEST_P(Unshadowed, IsItInMotion) {
  JobSpec job = unshadowed_job(GetParam(), 4, 3);
  test::set_in_motion(job, true, true);
  expect_agreement(job);
}
INSTANTIATE_TEST_SUITE_P(Methods, Unshadowed,
                         testing::Values(Method::pool, Method::bidirectional, Method::ratio,
                                         Method::mis, Method::environment, Method::reference,
                                         Method::sequential, Method::restir));

TEST(UnshadowedOf, SweepsIsTheLightWithoutOcclusion) {
  JobSpec job = unshadowed_job(Method::pool, 1, 2);
  job.quality.sweeps = 3;
  expect_agreement(job);
}

}  // namespace
}  // namespace baton
