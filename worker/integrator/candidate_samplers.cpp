#include "worker/integrator/candidate_samplers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "worker/sampling/ess.h"
#include "worker/sampling/systematic_choice.h"

namespace baton {
namespace {

/// A pixel that no light reaches: no contribution, whatever the directions.
void set_dark(const PixelSamples& samples) {
  std::fill(samples.direction.begin(), samples.direction.end(), OctDirection{0});
  std::fill(samples.site.begin(), samples.site.end(), std::uint8_t{0});
  for (const std::span<float>& zero : {samples.weight, samples.r, samples.g, samples.b}) {
    std::fill(zero.begin(), zero.end(), 0.0f);
  }
  samples.lns = 0;
}

/// Makes candidate `pick` sample `j`.
void take(const kernels::CandidateSet& from, std::size_t pick, std::size_t j, float weight,
          const PixelSamples& samples) {
  samples.direction[j] = from.code[pick];
  samples.site[j] = static_cast<std::uint8_t>(from.site[pick]);
  samples.weight[j] = weight;
  samples.r[j] = from.r[pick];
  samples.g[j] = from.g[pick];
  samples.b[j] = from.b[pick];
}

/// Fills `scratch`; false when there is nothing to choose from.
bool draw(const PixelInput& input, const CandidateCounts& counts, kernels::CandidateSet& scratch,
          const PixelSamples& samples) {
  kernels::draw_candidates(input.sites, input.now, input.light.pool, counts,
                           Rng(input.key, PassId::candidates), scratch);
  samples.source = PixelSource::fresh;
  const bool lit = scratch.count > 0 && scratch.total > 0 && std::isfinite(scratch.total);
  if (!lit) set_dark(samples);
  samples.lns = samples.lns_fresh = lit ? scratch.total : 0.0f;
  return lit;
}

}  // namespace

CandidateCounts split_candidates(std::int32_t total, float brdf_fraction) {
  const auto from_bsdf =
      static_cast<std::int32_t>(std::lround(static_cast<float>(total) * brdf_fraction));
  return {total - from_bsdf, from_bsdf};
}

CandidateCounts candidate_counts(const SiteBlock& sites, std::int32_t total, float lobe_fraction) {
  if (lobe_fraction >= 1) return {.from_bsdf = total};
  constexpr std::int32_t kVector = 8;  // candidates that cost as much as one
  const float specular = sites.specular_sum / static_cast<float>(std::max(sites.num_hits, 1));
  const float wanted = lobe_fraction * specular * static_cast<float>(total);
  const std::int32_t rounded = static_cast<std::int32_t>(std::ceil(wanted / kVector)) * kVector;
  const std::int32_t from_bsdf = sites.num_lobes > 0 ? std::min(rounded, total / 2) : 0;
  return {.from_light = total - from_bsdf, .from_bsdf = from_bsdf, .lobe_only = true};
}

PixelDiagnostics DirectSampler::sample(const PixelInput& input, SamplerScratch& scratch,
                                       const PixelSamples& samples) const {
  PixelDiagnostics diagnostics{.target_evaluations = counts_.total()};
  kernels::CandidateSet& candidates = scratch.candidates;
  if (!draw(input, counts_, candidates, samples)) return diagnostics;
  const float inverse = 1.0f / candidates.total;
  for (std::size_t j = 0; j < samples.weight.size(); ++j) {
    take(candidates, j, j, candidates.weight[j] * inverse, samples);
  }
  diagnostics.ess = effective_sample_size(samples.weight);
  return diagnostics;
}

PixelDiagnostics BidirectionalSampler::sample(const PixelInput& input, SamplerScratch& scratch,
                                              const PixelSamples& samples) const {
  PixelDiagnostics diagnostics{.target_evaluations = num_candidates_};
  kernels::CandidateSet& candidates = scratch.candidates;
  const CandidateCounts counts = candidate_counts(input.sites, num_candidates_, lobe_fraction_);
  if (!draw(input, counts, candidates, samples)) return diagnostics;
  std::array<std::int32_t, limits::kMaxParticles> storage{};
  const std::span<std::int32_t> chosen = std::span(storage).first(samples.weight.size());
  const float u = Rng(input.key, PassId::choose).uniforms(0, 0)[0];
  systematic_choice({candidates.weight, static_cast<std::size_t>(candidates.count)}, u, chosen);
  const float share = 1.0f / static_cast<float>(chosen.size());
  for (std::size_t j = 0; j < chosen.size(); ++j) {
    take(candidates, static_cast<std::size_t>(chosen[j]), j, share, samples);
  }
  diagnostics.ess = static_cast<float>(chosen.size());
  return diagnostics;
}

}  // namespace baton
