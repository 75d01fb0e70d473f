#include "worker/method/pool/pool_method.h"

#include <algorithm>

#include "common/base/poison.h"
#include "common/job/job_facts.h"
#include "common/state/memory_plane.h"
#include "worker/method/fresh/candidate_samplers.h"
#include "worker/sampling/light_noise.h"
#include "worker/sampling/visibility_table.h"

namespace baton {
namespace {

/// The number of candidates of each kind, by their noise in earlier frames. Where the sites are
/// glossy only, twice as many as usual come from the lobes: those of the light rarely fall into a
/// narrow one.
kernels::CandidateCounts counts_for_noise(const PoolTuning& tuning, const SiteBlock& sites,
                                          std::int32_t num_candidates, float lobe_fraction,
                                          const LightVariance& known) {
  const float specular = sites.specular_sum / static_cast<float>(std::max(sites.num_hits, 1));
  const float of_lobes = std::min(lobe_fraction * (1 + specular), 0.5f);
  kernels::CandidateCounts counts =
      candidate_counts(sites, num_candidates, lobe_fraction < 1 ? of_lobes : 1.0f);
  if (const std::int32_t usual = counts.from_light; usual > 0) {
    const std::int32_t most = limits::kMaxCandidates - counts.from_bsdf;
    const bool may_go_below = counts.from_bsdf > 0 && usual >= tuning.enough_beside_lobes;
    counts.from_light =
        std::clamp(candidates_for_noise(tuning, tuning.light, usual, known.from_light, most),
                   may_go_below ? 0 : tuning.fewest_judged, most);
    // Whole blocks: of a block that is not read to its end the same eighths of the curve are
    // missing in every pixel (M = 25: the mean 4 % low).
    constexpr std::int32_t kBlock = PresampledLight::kBlock;
    counts.from_light =
        std::min((counts.from_light + kBlock - 1) / kBlock * kBlock, most / kBlock * kBlock);
  }
  counts.from_bsdf = candidates_for_noise(tuning, tuning.lobes, counts.from_bsdf, known.from_lobes,
                                          limits::kMaxCandidates - counts.from_light);
  return counts;
}

}  // namespace

PixelMethod make_pool_method(const JobSpec& job, const PoolTuning& tuning) {
  const bool remembers = carries_state(job);
  return {.format = remembers ? static_cast<const StateFormat*>(&memory_format(has_catcher(job)))
                              : static_cast<const StateFormat*>(&sample_format()),
          .start = [spec = job.sampling, remembers, tuning] {
            return std::make_unique<PoolSampler>(spec, remembers, tuning);
          }};
}

/// What the pixel's rays go into.
BlockMemory& PoolSampler::memory_of(const PixelState& pixel) {
  return block_memory_plane(pixel.tile,
                            StateFormat::block_plane_of(
                                pixel.sees_catcher))[PixelBlocks(pixel.tile.rect).of(pixel.index)];
}

const VisibilityTable& PoolSampler::table_of(const PixelState& pixel) {
  const BlockMemory* const wanted = &memory_of(pixel);
  if (!has_table_ || wanted != table_is_of_) {
    table_.read(*wanted, tuning_.prior_rays);
    table_is_of_ = wanted;
    has_table_ = true;
  }
  return table_;
}

/// Prefetches what the pixel's block remembers, where the one in work is of another: the memories
/// of a tile are larger than the caches.
void PoolSampler::look_ahead(const RoundLight& /*light*/, bool /*has_history*/,
                             const PixelState& pixel) {
  if (!remembers_) return;
  const BlockMemory* const memory = &memory_of(pixel);
  if (has_table_ && memory == table_is_of_) return;
  const auto* const bytes = reinterpret_cast<const std::byte*>(memory);
  for (std::size_t at = 0; at < sizeof(BlockMemory); at += 64) __builtin_prefetch(bytes + at);
}

PixelDiagnostics PoolSampler::sample(const PixelInput& input, const PixelState& pixel,
                                     RayWriter& rays) {
  static const VisibilityTable kNothing{};
  poison(scratch_);
  poison(rays_);
  static const PixelMemory kUnknown{};
  PixelMemory* const own = remembers_ ? &pixel_memory_plane(pixel.tile)[pixel.index] : nullptr;
  const PixelVisibility memory(remembers_ ? table_of(pixel) : kNothing,
                               own != nullptr ? *own : kUnknown, tuning_.own_prior_rays);
  const kernels::CandidateCounts counts =
      counts_for_noise(tuning_, input.sites, num_candidates_, lobe_fraction_,
                       light_variance(own != nullptr ? *own : kUnknown));
  const kernels::CandidateSource candidates = candidate_source(input, counts);
  const float total = kernels::choose_pool_rays(tuning_, candidates,
                                                Rng(input.key, PassId::choose).uniforms(0, 0)[0],
                                                num_rays_, memory, scratch_, rays_);
  if (own != nullptr && rays_.count > 0)
    remember_light_variance(tuning_, rays_.light_variance, *own);
  const auto source = input.start.has_history ? PixelSource::carried : PixelSource::fresh;
  return write_chosen(total, candidates, source, input, pixel, rays);
}

void PoolSampler::learn(const FoundRays& found, const PixelState& pixel) {
  if (!remembers_) return;
  remember_rays(found.tag, found.is_free, memory_of(pixel),
                pixel_memory_plane(pixel.tile)[pixel.index]);
}

}  // namespace baton
