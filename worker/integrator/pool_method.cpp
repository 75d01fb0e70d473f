#include "worker/integrator/pool_method.h"

#include <algorithm>
#include <array>

#include "worker/integrator/candidate_samplers.h"
#include "worker/sampling/light_noise.h"
#include "worker/sampling/pool.h"

namespace baton {
namespace {

/// Fewest candidates of the light: noise is told by second differences, which take three vectors of
/// eight, and who cannot tell would keep too few for good. (Glossy pixels that usually have 64 may
/// go below: where they once had little noise, it is candidates from lobes that they live on.)
constexpr std::int32_t kFewestJudged = 24;
std::int32_t least_of_light(const kernels::CandidateCounts& usual) {
  const bool may_go_below = usual.from_bsdf > 0 && usual.from_light >= 64;
  return usual.from_light == 0 || may_go_below ? 0 : kFewestJudged;
}

/// As many candidates of each kind as their noise in earlier frames asks for. Where sites see
/// nothing but gloss, twice as many as usual come from the lobes: narrow ones see little of the
/// light's.
kernels::CandidateCounts counts_for_noise(const SiteBlock& sites, std::int32_t num_candidates,
                                          float lobe_fraction, const LightVariance& known) {
  const float specular = sites.specular_sum / static_cast<float>(std::max(sites.num_hits, 1));
  const float of_lobes = std::min(lobe_fraction * (1 + specular), 0.5f);
  kernels::CandidateCounts counts =
      candidate_counts(sites, num_candidates, lobe_fraction < 1 ? of_lobes : 1.0f);
  const std::int32_t most_of_light = limits::kMaxCandidates - counts.from_bsdf;
  counts.from_light = std::clamp(
      candidates_for_noise(counts.from_light, known.from_light, kNeedOfLight, most_of_light),
      least_of_light(counts), most_of_light);
  // Whole blocks: of a block that is not read to its end the same eighths of the curve are missing
  // in every pixel (M = 25: the mean 4 % low).
  constexpr std::int32_t kBlock = LightPool::kBlock;
  counts.from_light =
      std::min((counts.from_light + kBlock - 1) / kBlock * kBlock, most_of_light / kBlock * kBlock);
  counts.from_bsdf = candidates_for_noise(counts.from_bsdf, known.from_lobes, kNeedOfLobes,
                                          limits::kMaxCandidates - counts.from_light);
  return counts;
}

}  // namespace

PixelDiagnostics PoolMethod::sample(const PixelInput& input, const PixelState& pixel,
                                    SamplerScratch& scratch, RayWriter& rays) const {
  static constexpr std::array<VisibilityCell, kVisibilityCells> kNothing{};
  const std::span<MemoryCell> own = pixel.memory();
  const std::span<const VisibilityCell> memory =
      own.empty() ? std::span<const VisibilityCell>(kNothing) : own;
  const kernels::CandidateCounts counts =
      counts_for_noise(input.sites, num_candidates_, lobe_fraction_, light_variance(memory));
  const float total = kernels::choose_pool_rays(input.sites, input.now, input.light.pool, counts,
                                                Rng(input.key, PassId::candidates),
                                                Rng(input.key, PassId::choose).uniforms(0, 0)[0],
                                                num_rays_, memory, scratch.pool, scratch.rays);
  if (!own.empty() && scratch.rays.count > 0)
    remember_light_variance(own, scratch.rays.light_variance);
  const auto source = input.has_history ? PixelSource::carried : PixelSource::fresh;
  return settle(total, counts.total(), source, scratch.rays, pixel, rays);
}

void PoolMethod::learn(const FoundRays& found, const PixelState& pixel) const {
  if (!pixel.memory().empty()) remember_rays(pixel.memory(), found.tag, found.is_free);
}

}  // namespace baton
