#include "worker/pass/pixel_books.h"

namespace baton {
namespace {

float acceptance_rate(const MoveCounts& moves) {
  return moves.proposed > 0
             ? static_cast<float>(moves.accepted) / static_cast<float>(moves.proposed)
             : 0.0f;
}

}  // namespace

void record_geometry(std::span<const SurfaceHit> hits, PixelResult& pixel) {
  float num_hits = 0, depth = 0;
  Vec3 normal;
  for (const SurfaceHit& hit : hits) {
    if (!hit.hit || hit.is_catcher) continue;
    if (num_hits == 0) pixel.material = hit.material + 1;
    num_hits += 1;
    normal += hit.point.ns;
    depth += hit.depth;
  }
  if (num_hits == 0) return;
  pixel.coverage = num_hits / static_cast<float>(hits.size());
  pixel.normal = num_hits > 1 ? normalize(normal) : normal;
  pixel.depth = depth / num_hits;
}

void record_sampling(const PixelDiagnostics& did, PixelResult& pixel, SamplingStats& stats) {
  pixel.ess_ratio = did.ess / static_cast<float>(did.num_samples);
  pixel.acceptance = acceptance_rate({did.local.proposed + did.independent.proposed,
                                      did.local.accepted + did.independent.accepted});
  pixel.acceptance_local = acceptance_rate(did.local);
  pixel.acceptance_independent = acceptance_rate(did.independent);
  pixel.resampled = did.resampled ? 1.0f : 0.0f;

  stats.pixels_fresh += pixel.source == PixelSource::fresh ? 1 : 0;
  stats.pixels_carried += pixel.source == PixelSource::carried ? 1 : 0;
  stats.pixels_restarted += pixel.source == PixelSource::restarted ? 1 : 0;
  stats.pixels_refreshed += pixel.source == PixelSource::refreshed ? 1 : 0;
  stats.pixels_refreshed_by_ratio += did.refreshed_by_ratio ? 1 : 0;
  stats.pixels_resampled += did.resampled ? 1 : 0;
  stats.local_proposed += static_cast<std::uint64_t>(did.local.proposed);
  stats.local_accepted += static_cast<std::uint64_t>(did.local.accepted);
  stats.independent_proposed += static_cast<std::uint64_t>(did.independent.proposed);
  stats.independent_accepted += static_cast<std::uint64_t>(did.independent.accepted);
  stats.count_ess(pixel.ess_ratio);
}

}  // namespace baton
