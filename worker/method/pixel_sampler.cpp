#include "worker/method/pixel_sampler.h"

#include <cmath>

#include "worker/method/restir/restir_sampler.h"
#include "worker/method/sequential/sequential_sampler.h"

namespace baton {

namespace {

std::unique_ptr<const PixelSampler> make_sequential_sampler(const SamplingSpec& spec) {
  const SequentialSettings settings{.num_particles = spec.num_particles,
                                    .num_distributions = spec.num_distributions,
                                    .num_moves = spec.num_moves,
                                    .ess_ratio_min = spec.ess_ratio_min,
                                    .resampling = spec.resampling,
                                    .lns_update = spec.lns_update,
                                    .local_move_cosine = std::cos(spec.local_move_deg * kPi / 180),
                                    .local_move_fraction = spec.local_move_fraction};
  SamplingSpec start = spec;
  start.method = spec.start_method;
  return std::make_unique<SequentialSampler>(
      settings, make_pixel_sampler(start), spec.refresh_every, spec.refresh_ratio,
      BidirectionalSampler(spec.refresh_candidates, spec.brdf_fraction));
}

}  // namespace

std::unique_ptr<const PixelSampler> make_pixel_sampler(const SamplingSpec& spec) {
  const std::int32_t n = spec.num_particles;
  switch (spec.method) {
    case Method::environment:
      return std::make_unique<DirectSampler>(CandidateCounts{.from_light = n});
    case Method::brdf:
      return std::make_unique<DirectSampler>(CandidateCounts{.from_bsdf = n});
    case Method::mis:
      return std::make_unique<DirectSampler>(split_candidates(n, spec.brdf_fraction));
    case Method::bidirectional:
      return std::make_unique<BidirectionalSampler>(spec.num_candidates, spec.brdf_fraction);
    case Method::sequential:
      return make_sequential_sampler(spec);
    case Method::restir:
      return std::make_unique<RestirSampler>(spec);
    case Method::reference:
    case Method::pool:
    case Method::ratio:
    case Method::automatic:
      break;
  }
  return nullptr;
}

}  // namespace baton
