#include "worker/method/sequential/sequential_sampler.h"

#include <cmath>

#include "worker/method/sequential/sequential_kernels.h"

namespace baton {
namespace {

/// Whether the pixel starts afresh in this frame. A pixel's turn comes every `refresh_every`
/// frames; the turns are spread over the image and over the frames but the second, in which every
/// pixel has just begun.
bool is_refresh_turn(const RngKey& key, std::int32_t rounds_before, std::int32_t refresh_every) {
  if (refresh_every == 0) return false;
  if (refresh_every <= 2) return rounds_before % refresh_every == 0;
  const Rng rng({.job_seed = key.job_seed, .frame = 0, .pixel = key.pixel}, PassId::refresh);
  const auto turn =
      static_cast<std::int32_t>(rng.bits(0, 0)[0] % static_cast<std::uint32_t>(refresh_every - 1));
  return (rounds_before - 2 - turn) % refresh_every == 0;
}

}  // namespace

bool SequentialSampler::has_wandered(float lns, float lns_fresh) const {
  return refresh_ratio_ && (lns > lns_fresh * *refresh_ratio_ || lns * *refresh_ratio_ < lns_fresh);
}

PixelDiagnostics SequentialSampler::sample(const PixelInput& input, SamplerScratch& scratch,
                                           const PixelSamples& samples) const {
  if (!input.has_history) return start_->sample(input, scratch, samples);
  if (is_refresh_turn(input.key, input.rounds_before, refresh_every_)) {
    const PixelDiagnostics diagnostics = start_->sample(input, scratch, samples);
    samples.source = PixelSource::refreshed;
    return diagnostics;
  }

  // Carry the particles over. Where the target is that of the frame before, they are properly
  // weighted already and stay as they are.
  SequentialSettings settings = settings_;
  if (input.sites.num_lobes == 0) settings.local_move_fraction = 0;
  if (input.light.still && input.old == nullptr) {
    settings.num_distributions = 1;
    settings.num_moves = 0;
    settings.ess_ratio_min = 0;
  }
  const SequentialOutcome outcome = kernels::sequential_step(
      input.sites, input.old, carried_light(input),
      input.located.empty() ? nullptr : &input.located.front(), settings, samples.lns, input.key,
      {samples.direction.data(), samples.site.data(), samples.weight.data(), samples.r.data(),
       samples.g.data(), samples.b.data(),
       input.target_before.empty() ? nullptr : input.target_before.data()});
  PixelDiagnostics diagnostics{
      // Both targets at the old positions and at every proposal.
      .ess = outcome.ess,
      .target_evaluations =
          2 * settings.num_particles * (settings.num_distributions * settings.num_moves + 1),
      .local = outcome.local,
      .independent = outcome.independent,
      .resampled = outcome.resampled};
  diagnostics.refreshed_by_ratio = outcome.alive && has_wandered(outcome.lns, samples.lns_fresh);
  if (outcome.alive && !diagnostics.refreshed_by_ratio) {
    samples.lns = outcome.lns;
    samples.source = PixelSource::carried;
    return diagnostics;
  }

  // All weights died, or Lns has gone too far from its last start: start again, and say so.
  const PixelSampler& start = outcome.alive ? static_cast<const PixelSampler&>(by_ratio_) : *start_;
  const PixelDiagnostics again = start.sample(input, scratch, samples);
  samples.source = outcome.alive ? PixelSource::refreshed : PixelSource::restarted;
  diagnostics.ess = again.ess;
  diagnostics.target_evaluations += again.target_evaluations;
  return diagnostics;
}

}  // namespace baton
