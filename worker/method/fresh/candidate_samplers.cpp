#include "worker/method/fresh/candidate_samplers.h"

#include <algorithm>
#include <cmath>

#include "common/base/poison.h"
#include "worker/sampling/ess.h"

namespace baton {
namespace {

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

/// Sets what a pixel's candidates made of Lns; false when there is no light, which makes it dark.
bool set_lns(float total, const PixelSamples& samples) {
  const bool lit = total > 0 && std::isfinite(total);
  if (!lit) set_dark(samples);
  samples.lns = samples.lns_fresh = lit ? total : 0.0f;
  return lit;
}

/// Most candidates from lobes. One costs as much as ten of the light's, since it reads texels that
/// fit into no cache, and so many well spread points suffice: of M = 800, 200 lower the error of a
/// lacquered bunny by 2 % for 20 % more time, that of gold not at all (8 renderings).
constexpr std::int32_t kMaxLobeCandidates = 64;

}  // namespace

void set_dark(const PixelSamples& samples) {
  std::fill(samples.direction.begin(), samples.direction.end(), OctDirection{0});
  std::fill(samples.site.begin(), samples.site.end(), std::uint8_t{0});
  for (const std::span<float>& zero : {samples.weight, samples.r, samples.g, samples.b}) {
    std::fill(zero.begin(), zero.end(), 0.0f);
  }
  samples.lns = 0;
}

CandidateCounts split_candidates(std::int32_t total, float brdf_fraction) {
  const std::int32_t from_bsdf = num_from_brdf(total, brdf_fraction);
  return {total - from_bsdf, from_bsdf};
}

CandidateCounts candidate_counts(const SiteBlock& sites, std::int32_t total, float lobe_fraction) {
  if (lobe_fraction >= 1) return {.from_bsdf = total};
  constexpr std::int32_t kVector = 8;  // candidates that cost as much as one
  // Where geometry is fine each site gets one of each kind at least: those that get none would be
  // noise.
  const bool fine = sites.num_hits > limits::kMaxSites;
  if (fine) total = std::max(total, 2 * sites.num_hits);
  const float specular = sites.specular_sum / static_cast<float>(std::max(sites.num_hits, 1));
  const float wanted = lobe_fraction * specular * static_cast<float>(total);
  const std::int32_t rounded = static_cast<std::int32_t>(std::ceil(wanted / kVector)) * kVector;
  const std::int32_t most = std::min(total / 2, kMaxLobeCandidates);
  std::int32_t from_bsdf = sites.num_lobes > 0 ? std::min(rounded, most) : 0;
  if (fine) from_bsdf = std::max(from_bsdf, sites.num_lobes);
  return {.from_light = total - from_bsdf, .from_bsdf = from_bsdf, .lobe_only = true};
}

PixelDiagnostics DirectSampler::sample(const PixelInput& input, const PixelSamples& samples) {
  PixelDiagnostics diagnostics{.target_evaluations = counts_.total()};
  poison(candidates_);
  kernels::draw_candidates(candidate_source(input, counts_), candidates_);
  samples.source = PixelSource::fresh;
  if (!set_lns(candidates_.total, samples)) return diagnostics;
  const float inverse = 1.0f / candidates_.total;
  for (std::size_t j = 0; j < samples.weight.size(); ++j) {
    take(candidates_, j, j, candidates_.weight[j] * inverse, samples);
  }
  diagnostics.ess = effective_sample_size(samples.weight);
  return diagnostics;
}

PixelDiagnostics BidirectionalSampler::sample(const PixelInput& input,
                                              const PixelSamples& samples) {
  poison(choice_);
  const CandidateCounts counts = candidate_counts(input.sites, num_candidates_, lobe_fraction_);
  PixelDiagnostics diagnostics{.target_evaluations = counts.total()};
  const float total = kernels::choose_candidates(
      candidate_source(input, counts), Rng(input.key, PassId::choose).uniforms(0, 0)[0], choice_,
      {samples.direction, samples.site, samples.r, samples.g, samples.b});
  samples.source = PixelSource::fresh;
  if (!set_lns(total, samples)) return diagnostics;
  std::fill(samples.weight.begin(), samples.weight.end(),
            1.0f / static_cast<float>(samples.weight.size()));
  diagnostics.ess = static_cast<float>(samples.weight.size());
  return diagnostics;
}

}  // namespace baton
