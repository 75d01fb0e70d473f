#include "worker/method/sequential/sequential_sampler.h"

#include <cmath>

#include "common/base/poison.h"
#include "worker/method/fresh/candidate_samplers.h"
#include "worker/method/sequential/sequential_kernels.h"
#include "worker/method/weighted/populations.h"

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

SequentialSettings settings_of(const SamplingSpec& spec) {
  return {.num_particles = spec.num_particles,
          .num_distributions = spec.num_distributions,
          .num_moves = spec.num_moves,
          .ess_ratio_min = spec.ess_ratio_min,
          .resampling = spec.resampling,
          .lns_update = spec.lns_update,
          .local_move_cosine = std::cos(spec.local_move_deg * kPi / 180),
          .local_move_fraction = spec.local_move_fraction};
}

}  // namespace

void LocatedAhead::clear() {
  for (Slot& slot : slots_) slot.pixel = kNone;
}

void LocatedAhead::locate(const EnvironmentView& now, const EnvironmentView* before,
                          const PixelState& pixel) {
  Slot& slot = slots_[next_];
  next_ = 1 - next_;
  poison(slot.populations);
  slot.pixel = pixel.index;
  const SampleState& state = pixel.tile;
  const auto populations = static_cast<std::size_t>(state.num_populations);
  const std::size_t n = static_cast<std::size_t>(state.num_particles) / populations;
  const std::span<const OctDirection> all = ConstSamplePlanes(state).direction;
  for (std::size_t k = 0; k < populations; ++k) {
    kernels::locate_directions(now, before, all.subspan((pixel.index * populations + k) * n, n),
                               slot.populations[k]);
  }
}

const kernels::LocatedDirections* LocatedAhead::find(const PixelState& pixel,
                                                     std::size_t population) const {
  for (const Slot& slot : slots_) {
    if (slot.pixel == pixel.index) return &slot.populations[population];
  }
  return nullptr;
}

SequentialSampler::SequentialSampler(const JobSpec& job) : WeightedSampler(job) {
  const SamplingSpec spec = population_spec(job);
  settings_ = settings_of(spec);
  refresh_every_ = spec.refresh_every;
  refresh_ratio_ = spec.refresh_ratio;
  start_ = make_fresh_sampler(spec);
  if (refresh_ratio_) {
    by_ratio_ = std::make_unique<BidirectionalSampler>(spec.refresh_candidates, spec.brdf_fraction);
  }
}

PixelMethod make_sequential_method(const JobSpec& job) {
  return {.format = &sample_format(),
          .start = [job] { return std::make_unique<SequentialSampler>(job); }};
}

void SequentialSampler::begin_round(const SampleState& state, bool goes_on) {
  WeightedSampler::begin_round(state, goes_on);
  located_.clear();
}

/// Carried directions are evaluated: maps are larger than the caches.
void SequentialSampler::look_ahead(const RoundLight& light, bool has_history,
                                   const PixelState& pixel) {
  if (!has_history) return;
  located_.locate(light.now, knows_targets() || light.frame.still ? nullptr : &light.before, pixel);
}

bool SequentialSampler::has_wandered(float lns, float lns_fresh) const {
  return refresh_ratio_ && (lns > lns_fresh * *refresh_ratio_ || lns * *refresh_ratio_ < lns_fresh);
}

PixelDiagnostics SequentialSampler::draw(const PixelInput& input, const SetPlace& at,
                                         const PixelSamples& samples) {
  if (!input.start.has_history) return start_->sample(input, samples);
  if (is_refresh_turn(input.key, input.rounds_before, refresh_every_)) {
    const PixelDiagnostics diagnostics = start_->sample(input, samples);
    samples.source = PixelSource::refreshed;
    return diagnostics;
  }

  // Carry the particles over. Where the target is that of the frame before, they are properly
  // weighted already and stay as they are.
  SequentialSettings settings = settings_;
  if (input.sites.num_lobes == 0) settings.local_move_fraction = 0;
  if (input.light.frame.still && input.start.old == nullptr) {
    settings.num_distributions = 1;
    settings.num_moves = 0;
    settings.ess_ratio_min = 0;
  }
  const SequentialOutcome outcome = kernels::sequential_step(
      input.sites, input.start.old, carried_light(input), located_.find(at.pixel, at.population),
      settings, samples.lns, input.key,
      {samples.direction.data(), samples.site.data(), samples.weight.data(), samples.r.data(),
       samples.g.data(), samples.b.data(),
       at.target_before.empty() ? nullptr : at.target_before.data()});
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
  const PixelDiagnostics again = (outcome.alive ? by_ratio_ : start_)->sample(input, samples);
  samples.source = outcome.alive ? PixelSource::refreshed : PixelSource::restarted;
  diagnostics.ess = again.ess;
  diagnostics.target_evaluations += again.target_evaluations;
  return diagnostics;
}

}  // namespace baton
