#include "worker/integrator/pixel_sampler.h"

#include <cmath>

#include "worker/integrator/pool_sampler.h"
#include "worker/integrator/ratio_sampler.h"
#include "worker/integrator/restir_sampler.h"
#include "worker/integrator/sequential_sampler.h"

namespace baton {

static_assert(kMemoryCells == kVisibilityCells && sizeof(MemoryCell) == sizeof(VisibilityCell));

namespace {

/// The sampler that draws all samples of a pixel anew.
std::unique_ptr<const PixelSampler> make_fresh_sampler(const SamplingSpec& spec,
                                                       StartMethod method) {
  const std::int32_t n = spec.num_particles;
  switch (method) {
    case StartMethod::environment:
      return std::make_unique<DirectSampler>(CandidateCounts{.from_light = n});
    case StartMethod::brdf:
      return std::make_unique<DirectSampler>(CandidateCounts{.from_bsdf = n});
    case StartMethod::mis:
      return std::make_unique<DirectSampler>(split_candidates(n, spec.brdf_fraction));
    case StartMethod::bidirectional:
      return std::make_unique<BidirectionalSampler>(spec.num_candidates, spec.brdf_fraction);
  }
  return nullptr;
}

std::unique_ptr<const PixelSampler> make_sequential_sampler(const SamplingSpec& spec) {
  const SequentialSettings settings{.num_particles = spec.num_particles,
                                    .num_distributions = spec.num_distributions,
                                    .num_moves = spec.num_moves,
                                    .ess_ratio_min = spec.ess_ratio_min,
                                    .resampling = spec.resampling,
                                    .lns_update = spec.lns_update,
                                    .local_move_cosine = std::cos(spec.local_move_deg * kPi / 180),
                                    .local_move_fraction = spec.local_move_fraction};
  return std::make_unique<SequentialSampler>(
      settings, make_fresh_sampler(spec, spec.start_method), spec.refresh_every, spec.refresh_ratio,
      BidirectionalSampler(spec.refresh_candidates, spec.brdf_fraction));
}

}  // namespace

std::unique_ptr<const PixelSampler> make_pixel_sampler(const SamplingSpec& spec) {
  switch (spec.method) {
    case Method::reference:
    case Method::automatic:
      return nullptr;
    case Method::environment:
      return make_fresh_sampler(spec, StartMethod::environment);
    case Method::brdf:
      return make_fresh_sampler(spec, StartMethod::brdf);
    case Method::mis:
      return make_fresh_sampler(spec, StartMethod::mis);
    case Method::bidirectional:
      return make_fresh_sampler(spec, StartMethod::bidirectional);
    case Method::sequential:
      return make_sequential_sampler(spec);
    case Method::pool:
      return std::make_unique<PoolSampler>(spec);
    case Method::ratio:
      return std::make_unique<RatioSampler>(spec);
    case Method::restir:
      return std::make_unique<RestirSampler>(spec);
  }
  return nullptr;
}

std::unique_ptr<const PixelSampler> make_material_sampler(const MaterialSampling& material) {
  SamplingSpec spec;
  spec.num_particles = material.num_particles;
  spec.num_candidates = material.num_candidates;
  spec.brdf_fraction = material.brdf_fraction;
  return make_fresh_sampler(spec, material.method);
}

}  // namespace baton
