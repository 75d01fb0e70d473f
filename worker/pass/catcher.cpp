#include "worker/pass/catcher.h"

#include <algorithm>

#include "worker/accel/accel.h"

namespace baton {

void see_catchers(const FrameGeometry& geometry, std::span<const std::uint16_t> num_sites,
                  std::span<const Ray> rays, std::span<SurfaceHit> hits) {
  if (!geometry.scene->has_catcher) return;
  std::vector<Ray> passed;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].hit) passed.push_back(rays[i]);
  }
  std::vector<SurfaceHit> caught(passed.size());
  geometry.accel->intersect_catchers(passed, caught);
  auto next = caught.cbegin();
  std::size_t first = 0;
  for (const std::size_t sites : num_sites) {
    const std::span<SurfaceHit> pixel = hits.subspan(first, sites);
    first += sites;
    const bool sees_object = std::ranges::any_of(pixel, &SurfaceHit::hit);
    for (SurfaceHit& hit : pixel) {
      if (hit.hit) continue;
      hit = *next++;
      hit.hit = hit.is_catcher && !sees_object;
    }
  }
}

float catcher_share(std::span<const SurfaceHit> hits) {
  const auto count = std::ranges::count_if(hits, &SurfaceHit::is_catcher);
  return static_cast<float>(count) / static_cast<float>(hits.size());
}

Rgb dark_share(std::span<const SurfaceHit> hits, const SiteBlock& sites) {
  Rgb count;
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (!hits[s].is_catcher || !hits[s].hit) continue;
    count += {sites.kd_r[s] == 0 ? 1.0f : 0, sites.kd_g[s] == 0 ? 1.0f : 0,
              sites.kd_b[s] == 0 ? 1.0f : 0};
  }
  return count / static_cast<float>(hits.size());
}

bool belongs_to_object(const SampleState& state, std::size_t index) {
  const PixelSource source = state.latest_source(index);
  return source != PixelSource::background && source != PixelSource::catcher;
}

bool is_of_its_kind(bool sees_catcher, const SampleState& state, std::size_t index) {
  return sees_catcher ? state.latest_source(index) == PixelSource::catcher
                      : belongs_to_object(state, index);
}

Rgb CatcherEdge::sample(const PixelMethod& method, const PixelInput& input, CatcherAlbedo& albedo,
                        const PixelState& pixel) {
  // The sites on catchers alone.
  hits_.assign(input.hits.begin(), input.hits.end());
  SiteOrigins origins;
  origins.num_sites = static_cast<std::int32_t>(hits_.size());
  for (std::size_t s = 0; s < hits_.size(); ++s) {
    hits_[s].hit = hits_[s].is_catcher;
    if (hits_[s].hit) origins.set(s, hits_[s].ray_origin);
  }
  gather_sites(*input.geometry, hits_, {}, sites_, albedo);
  const AsideSampler::Aside catcher{.sites = sites_,
                                    .hits = hits_,
                                    .origins = origins,
                                    .light = input.light,
                                    .presampled = input.presampled,
                                    .key = key_of(input),
                                    .starts_afresh = true};
  return aside_.sample(method, input, catcher, {pixel.tile, pixel.index, true}) +
         dark_share(hits_, sites_);
}

}  // namespace baton
