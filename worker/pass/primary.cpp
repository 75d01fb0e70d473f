#include "worker/pass/primary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "worker/light/candidates.h"
#include "worker/pass/catcher.h"
#include "worker/pass/site_rays.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

/// The textures at hits whose materials have detail; what the others have is never read.
std::vector<SurfaceShading> shadings_of(const FrameGeometry& geometry,
                                        std::span<const SurfaceHit> hits) {
  std::vector<SurfaceShading> shadings(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].hit && !hits[i].is_catcher && geometry.material_of(hits[i]).detail != nullptr)
      shadings[i] = SurfaceShading::of(geometry.see(hits[i]));
  }
  return shadings;
}

}  // namespace

TileSurfaces trace_primary(const JobSpec& job, const FrameGeometry& geometry, const PixelRect& rect,
                           std::int32_t round) {
  TileSurfaces surfaces;
  trace_primary(job, geometry, rect, RoundPixels::all(static_cast<std::size_t>(rect.area())), round,
                {}, surfaces);
  return surfaces;
}

void trace_primary(const JobSpec& job, const FrameGeometry& geometry, const PixelRect& rect,
                   RoundPixels pixels, std::int32_t round, std::span<const std::uint16_t> counts,
                   TileSurfaces& surfaces) {
  surfaces.rect = rect;
  surfaces.pixels = std::move(pixels);
  surfaces.first_hit.assign(1, 0);
  surfaces.rays.clear();
  surfaces.first_site.clear();
  const std::size_t num_slots = surfaces.pixels.size();
  const auto usual = static_cast<std::uint16_t>(job.image.sites);
  SiteRays sites(job, geometry.pose.camera, round);
  std::vector<std::uint16_t> num_sites;
  num_sites.reserve(num_slots);
  surfaces.first_hit.reserve(num_slots + 1);
  surfaces.rays.reserve(num_slots * usual);
  for (std::size_t slot = 0; slot < num_slots; ++slot) {
    const std::size_t index = surfaces.pixels.index(slot);
    const auto [x, y] = rect.place(index);
    num_sites.push_back(counts.empty() ? usual : counts[index]);
    sites.append(x, y, num_sites.back(), surfaces.rays);
    surfaces.first_hit.push_back(static_cast<std::uint32_t>(surfaces.rays.size()));
  }
  surfaces.hits.resize(surfaces.rays.size());  // all are written below
  trace_primary_rays(geometry, surfaces.rays, num_sites, surfaces.hits);
  surfaces.first_site.reserve(num_slots);
  for (std::size_t slot = 0; slot < num_slots; ++slot) {
    const std::span<const SurfaceHit> hits = surfaces.pixel(slot);
    const auto first =
        std::find_if(hits.begin(), hits.end(), [](const SurfaceHit& hit) { return hit.hit; });
    surfaces.first_site.push_back(static_cast<std::uint16_t>(first - hits.begin()));
  }
  if (geometry.scene->has_detail) surfaces.shadings = shadings_of(geometry, surfaces.hits);
}

TileSurfaces part_of(const TileSurfaces& whole, RoundPixels pixels) {
  TileSurfaces part{.rect = whole.rect,
                    .pixels = std::move(pixels),
                    .first_hit = {0},
                    .hits = {},
                    .rays = {},
                    .shadings = {},
                    .first_site = {}};
  const auto take = [](auto some, auto& all) { all.insert(all.end(), some.begin(), some.end()); };
  for (std::size_t slot = 0; slot < part.pixels.size(); ++slot) {
    const std::size_t index = part.pixels.index(slot);
    take(whole.pixel(index), part.hits);
    take(whole.pixel_rays(index), part.rays);
    take(whole.pixel_shadings(index), part.shadings);
    part.first_hit.push_back(static_cast<std::uint32_t>(part.hits.size()));
    part.first_site.push_back(whole.first_site[index]);
  }
  return part;
}

void trace_primary_rays(const FrameGeometry& geometry, std::span<const Ray> rays,
                        std::span<const std::uint16_t> num_sites, std::span<SurfaceHit> hits) {
  // The sites of a pixel are a packet, or several. Pixels of equal sites are handed on together.
  std::size_t first = 0;
  for (std::size_t pixel = 0; pixel < num_sites.size();) {
    const std::size_t of_one = num_sites[pixel];
    std::size_t count = of_one;
    for (++pixel; pixel < num_sites.size() && num_sites[pixel] == of_one && of_one <= kMaxRayGroup;
         ++pixel) {
      count += of_one;
    }
    geometry.accel->intersect(rays.subspan(first, count), hits.subspan(first, count),
                              std::min(of_one, kMaxRayGroup));
    first += count;
  }
  see_catchers(geometry, num_sites, rays, hits);
  if (!geometry.scene->has_detail) return;
  first = 0;
  for (const std::size_t count : num_sites) {
    const float share = 1 / std::sqrt(static_cast<float>(count));
    for (std::size_t i = first; i < first + count; ++i) {
      if (!hits[i].hit || geometry.material_of(hits[i]).detail == nullptr) continue;
      const float pixel = geometry.pose.camera.pixel_width(rays[i].direction, hits[i].depth);
      hits[i].place.width = share * pixel;
    }
    first += count;
  }
}

void EnvironmentBehind::add(std::size_t pixel, std::span<const SurfaceHit> hits,
                            std::span<const Ray> rays) {
  const float share = 1.0f / static_cast<float>(hits.size());
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (hits[s].hit && !hits[s].is_catcher) continue;
    pixel_[count_] = pixel;
    share_[count_] = share;
    x_[count_] = rays[s].direction.x;
    y_[count_] = rays[s].direction.y;
    z_[count_] = rays[s].direction.z;
    if (++count_ == kBatch) flush();
  }
}

void EnvironmentBehind::flush() {
  std::array<float, kBatch> r, g, b;
  const auto used = [this](std::array<float, kBatch>& array) {
    return std::span(array).first(count_);
  };
  kernels::see_environment(environment_, used(x_), used(y_), used(z_), used(r), used(g), used(b));
  for (std::size_t i = 0; i < count_; ++i)
    radiance_[pixel_[i]] += Rgb{r[i], g[i], b[i]} * share_[i];
  count_ = 0;
}

}  // namespace baton
