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

bool SequentialSampler::has_wandered(float lns, float lns_fresh) const {
  return refresh_ratio_ && (lns > lns_fresh * *refresh_ratio_ || lns * *refresh_ratio_ < lns_fresh);
}

PixelDiagnostics SequentialSampler::sample(const PixelInput& input, kernels::CandidateSet& scratch,
                                           const PixelSamples& samples) const {
  if (!input.has_history) return start_->sample(input, scratch, samples);
  if (is_refresh_turn(input.key, input.frame_index, refresh_every_)) {
    const PixelDiagnostics diagnostics = start_->sample(input, scratch, samples);
    samples.source = PixelSource::refreshed;
    return diagnostics;
  }

  // Carry the particles over.
  SequentialSettings settings = settings_;
  if (input.sites.num_lobes == 0) settings.local_move_fraction = 0;
  const SequentialOutcome outcome = kernels::sequential_step(
      input.sites, input.old, input.before, input.now, input.light.pool, settings, samples.lns,
      input.key, {samples.direction.data(), samples.site.data(), samples.weight.data()});
  PixelDiagnostics diagnostics{
      // Both targets at the old positions and at every proposal.
      .ess = outcome.ess,
      .target_evaluations =
          2 * settings_.num_particles * (settings_.num_distributions * settings_.num_moves + 1),
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
  }
  return nullptr;
}

}  // namespace baton
