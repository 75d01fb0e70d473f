#include "worker/integrator/sequential_sampler.h"

#include <cmath>

namespace baton {
namespace {

/// Whether the pixel starts afresh in this frame. A pixel's turn comes every `refresh_every`
/// frames; the turns are spread over the image and over the frames but the second, in which every
/// pixel has just begun.
bool is_refresh_turn(const RngKey& key, std::int32_t frame_index, std::int32_t refresh_every) {
  if (refresh_every == 0) return false;
  if (refresh_every <= 2) return frame_index % refresh_every == 0;
  const Rng rng({.job_seed = key.job_seed, .frame = 0, .pixel = key.pixel}, PassId::refresh);
  const auto turn =
      static_cast<std::int32_t>(rng.bits(0, 0)[0] % static_cast<std::uint32_t>(refresh_every - 1));
  return (frame_index - 2 - turn) % refresh_every == 0;
}

}  // namespace

PixelDiagnostics SequentialSampler::sample(const PixelInput& input, kernels::CandidateSet& scratch,
                                           const PixelSamples& samples) const {
  if (!input.has_history) return start_.sample(input, scratch, samples);
  if (is_refresh_turn(input.key, input.frame_index, refresh_every_)) {
    const PixelDiagnostics diagnostics = start_.sample(input, scratch, samples);
    samples.source = PixelSource::refreshed;
    return diagnostics;
  }

  // Carry the particles over.
  SequentialSettings settings = settings_;
  if (input.sites.num_lobes == 0) settings.local_move_fraction = 0;
  const SequentialOutcome outcome = kernels::sequential_step(
      input.sites, input.before, input.now, input.light.pool, settings, samples.lns, input.key,
      {samples.direction.data(), samples.site.data(), samples.weight.data()});
  PixelDiagnostics diagnostics{
      // Both targets at the old positions and at every proposal.
      .ess = outcome.ess,
      .target_evaluations = 2 * settings_.num_particles * (settings_.num_distributions + 1),
      .moves_proposed = outcome.moves_proposed,
      .moves_accepted = outcome.moves_accepted,
      .resampled = outcome.resampled};
  if (outcome.alive) {
    samples.lns = outcome.lns;
    samples.source = PixelSource::carried;
    return diagnostics;
  }

  // All weights died: start again, and say so.
  const PixelDiagnostics restart = start_.sample(input, scratch, samples);
  samples.source = PixelSource::restarted;
  diagnostics.ess = restart.ess;
  diagnostics.target_evaluations += restart.target_evaluations;
  return diagnostics;
}

std::unique_ptr<const PixelSampler> make_pixel_sampler(const SamplingSpec& spec) {
  const std::int32_t n = spec.num_particles;
  const BidirectionalSampler bidirectional(spec.num_candidates, spec.brdf_fraction);
  switch (spec.method) {
    case Method::reference:
      return nullptr;
    case Method::environment:
      return std::make_unique<DirectSampler>(CandidateCounts{.from_light = n});
    case Method::brdf:
      return std::make_unique<DirectSampler>(CandidateCounts{.from_bsdf = n});
    case Method::mis:
      return std::make_unique<DirectSampler>(split_candidates(n, spec.brdf_fraction));
    case Method::bidirectional:
      return std::make_unique<BidirectionalSampler>(bidirectional);
    case Method::sequential:
      return std::make_unique<SequentialSampler>(
          SequentialSettings{.num_particles = n,
                             .num_distributions = spec.num_distributions,
                             .ess_ratio_min = spec.ess_ratio_min,
                             .resampling = spec.resampling,
                             .local_move_cosine = std::cos(spec.local_move_deg * kPi / 180),
                             .local_move_fraction = spec.local_move_fraction},
          bidirectional, spec.refresh_every);
  }
  return nullptr;
}

}  // namespace baton
