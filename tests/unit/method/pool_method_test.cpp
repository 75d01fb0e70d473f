// How many candidates a pixel of `pool` gets.
#include "worker/method/pool/pool_method.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <memory>
#include <vector>

#include "common/state/memory_plane.h"
#include "tests/support/remembered.h"
#include "worker/sampling/light_noise.h"
#include "worker/surface/bsdf.h"

namespace baton {
namespace {

/// The light of a map of 64 x 32 texels, a function of their number.
template <class Radiance>
FrameLight light_of(const Radiance& radiance) {
  RgbImage image{64, 32, {}};
  for (int i = 0; i < 64 * 32; ++i) {
    const float value = radiance(i);
    image.rgb.insert(image.rgb.end(), {value, value, value});
  }
  const Environment map{std::make_shared<EnvironmentMap>(image, MapFilter::nearest, 1.0f, false),
                        Mat3{}};
  return {.now = map,
          .before = map,
          .still = true,
          .turn = {},
          .presampled = std::make_shared<const PresampledSets>(
              presample_sets(map, map, 3, 1, {.one_run = true}, 0, 1))};
}
FrameLight sky() {
  return light_of([](int i) { return static_cast<float>(1 + (i * 37) % 23); });
}

/// A pixel that sees a diffuse floor, or a glossy one.
SiteBlock pixel(bool glossy) {
  MaterialSpec spec;
  spec.kind = glossy ? MaterialKind::metallic_roughness : MaterialKind::diffuse;
  spec.roughness = 0.2f;
  SiteBlock sites;
  sites.clear(1);
  sites.add(0,
            {.position = {}, .ng = {0, 1, 0}, .ns = {0, 1, 0}, .wo = normalize({0.3f, 0.8f, 0.4f})},
            make_material(spec));
  return sites;
}

/// One pixel and what sampling it needs.
struct OnePixel {
  OnePixel(const SamplingSpec& spec, bool remembers)
      : sampler(std::make_unique<PoolSampler>(spec, remembers)) {
    if (remembers) state.resize(memory_format(), {0, 0, 1, 1}, 0);
    if (!remembers) state.resize(sample_format(), {0, 0, 1, 1}, 0);
  }
  PixelDiagnostics sample(const FrameLight& light, const SiteBlock& sites, std::uint32_t number) {
    const RoundLight round{light};
    RayBatch batch;
    const SiteOrigins origins{};
    RayWriter rays(origins, batch);
    return sampler->sample({.sites = sites,
                            .light = round,
                            .presampled = light.presampled->sets.front(),
                            .key = {.job_seed = 5, .pixel = number}},
                           {state, 0}, rays);
  }

  SampleState state;
  std::unique_ptr<PoolSampler> sampler;
};

SamplingSpec spec_of(std::int32_t num_candidates) {
  SamplingSpec spec;
  spec.num_candidates = num_candidates;
  spec.num_particles = 16;
  return spec;
}

class PoolCounts : public testing::Test {
 protected:
  /// Candidates of a pixel in all. The noise that they show is then in seen_.
  std::int32_t sample(const FrameLight& light, const SiteBlock& sites, std::int32_t num_candidates,
                      const LightVariance& known) {
    OnePixel pixel(spec_of(num_candidates), true);
    remember_ray(block_memory_plane(pixel.state)[0], 0, true);
    remember_light_variance(PoolTuning{}, known, pixel_memory_plane(pixel.state)[0]);
    const PixelDiagnostics did = pixel.sample(light, sites, 0);
    seen_ = pixel.sampler->light_variance_seen();
    return did.target_evaluations;
  }

  LightVariance seen_;
};

// A pixel without memory reads whole blocks of the pool, whatever M is: else the same eighths of
// the curve would be missing in all pixels. H0: the mean over pixels is the albedo under a flat map
// of radiance 1; bound 1 % (M = 25 was 4.2 % low, M = 63 1.5 % high), standard error 0.1 %.
TEST_F(PoolCounts, AnyNumberOfCandidatesSeesTheWholeMap) {
  const FrameLight flat = light_of([](int) { return 1.0f; });
  const SiteBlock sites = pixel(false);
  for (const std::int32_t num_candidates : {25, 50, 63, 64, 130}) {
    double sum = 0;
    constexpr std::uint32_t kPixels = 4000;
    OnePixel pixel(spec_of(num_candidates), false);
    for (std::uint32_t i = 0; i < kPixels; ++i) {
      sum += pixel.sample(flat, sites, i).lns;
    }
    const double albedo = sites.kd_r[0];
    EXPECT_NEAR(sum / kPixels / albedo, 1, 0.01) << "M = " << num_candidates;
  }
}

// Too few to tell their noise would stay too few for good: with M = 16 and 32 glossy pixels had
// five to twenty times the error of M = 64.
TEST_F(PoolCounts, OfTheLightAreAlwaysEnoughToTellTheirNoise) {
  const FrameLight light = sky();
  for (const bool glossy : {false, true}) {
    for (const std::int32_t num_candidates : {1, 8, 16, 32, 64, 100}) {
      for (const float noise : {0.0f, 1e-12f}) {
        sample(light, pixel(glossy), num_candidates, {noise, noise});
        EXPECT_GT(seen_.from_light, 0) << num_candidates << " " << noise;
      }
    }
  }
}

TEST_F(PoolCounts, NeverExceedTheMost) {
  const FrameLight light = sky();
  for (const std::int32_t num_candidates : {8, 8000, 8190, 8192}) {
    const std::int32_t count = sample(light, pixel(true), num_candidates, {1e6f, 1e6f});
    EXPECT_LE(count, limits::kMaxCandidates) << num_candidates;
    EXPECT_GE(count, std::min(num_candidates * 32, limits::kMaxCandidates)) << num_candidates;
  }
}

}  // namespace
}  // namespace baton
