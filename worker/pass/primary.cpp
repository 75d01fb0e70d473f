#include "worker/pass/primary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/job/sequence.h"
#include "common/math/low_discrepancy.h"
#include "worker/light/candidates.h"
#include "worker/pass/catcher.h"
#include "worker/scene/pixel_filter.h"
#include "worker/scene/scene_kernels.h"

namespace baton {
namespace {

/// Grid of a pixel's sites: image.sites cells, each of them cut into 4^k where geometry is fine.
class SiteGrid {
 public:
  SiteGrid(std::int32_t coarse, std::int32_t sites)
      : coarse_(coarse), side_(root(coarse)), cuts_(root(sites / coarse)) {}
  /// Position of a site inside its pixel, [0, 1)^2, from two uniforms. Sites 0, 1, ... of the
  /// coarse grid come first: what needs few takes those.
  std::array<float, 2> position(std::int32_t site, float u, float v) const {
    const std::int32_t cell = site % coarse_, cut = site / coarse_;
    const auto width = 1.0f / static_cast<float>(side_ * cuts_);
    return {(static_cast<float>(cell % side_ * cuts_ + cut % cuts_) + u) * width,
            (static_cast<float>(cell / side_ * cuts_ + cut / cuts_) + v) * width};
  }

 private:
  static std::int32_t root(std::int32_t square) {
    return static_cast<std::int32_t>(std::sqrt(static_cast<float>(square)));
  }
  std::int32_t coarse_;
  std::int32_t side_;  ///< coarse cells in a row
  std::int32_t cuts_;  ///< of a coarse cell's side
};

/// Of hits whose materials have detail; what the others have is never read.
std::vector<SurfaceLook> looks_of(const FrameGeometry& geometry, std::span<const SurfaceHit> hits) {
  std::vector<SurfaceLook> looks(hits.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i].hit && !hits[i].is_catcher && geometry.material_of(hits[i]).detail != nullptr)
      looks[i] = SurfaceLook::of(geometry.see(hits[i]));
  }
  return looks;
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
  std::vector<std::uint16_t> num_sites;
  num_sites.reserve(num_slots);
  surfaces.first_hit.reserve(num_slots + 1);
  surfaces.rays.reserve(num_slots * usual);
  for (std::size_t slot = 0; slot < num_slots; ++slot) {
    const std::size_t index = surfaces.pixels.index(slot);
    const auto [x, y] = rect.place(index);
    num_sites.push_back(counts.empty() ? usual : counts[index]);
    append_primary_rays(job, geometry, x, y, surfaces.rays, round, num_sites.back());
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
  if (geometry.scene->has_detail) surfaces.looks = looks_of(geometry, surfaces.hits);
}

TileSurfaces part_of(const TileSurfaces& whole, RoundPixels pixels) {
  TileSurfaces part{.rect = whole.rect,
                    .pixels = std::move(pixels),
                    .first_hit = {0},
                    .hits = {},
                    .rays = {},
                    .looks = {},
                    .first_site = {}};
  const auto take = [](auto some, auto& all) { all.insert(all.end(), some.begin(), some.end()); };
  for (std::size_t slot = 0; slot < part.pixels.size(); ++slot) {
    const std::size_t index = part.pixels.index(slot);
    take(whole.pixel(index), part.hits);
    take(whole.pixel_rays(index), part.rays);
    take(whole.pixel_looks(index), part.looks);
    part.first_hit.push_back(static_cast<std::uint32_t>(part.hits.size()));
    part.first_site.push_back(whole.first_site[index]);
  }
  return part;
}

Rng site_random(const JobSpec& job, std::int32_t x, std::int32_t y) {
  const std::uint64_t seed = job.image.site_seed > 0 ? job.image.site_seed : job.seed;
  return {pixel_key(seed, 0, job.image.width, x, y), PassId::site_position};
}

void append_primary_rays(const JobSpec& job, const FrameGeometry& geometry, std::int32_t x,
                         std::int32_t y, std::vector<Ray>& rays, std::int32_t round,
                         std::int32_t num_sites) {
  const Camera& camera = geometry.pose.camera;
  const Rng rng = site_random(job, x, y);
  const bool own_sites = rounds_have_own_sites(job);
  const Philox4x32::Counter lens_shift = camera.has_lens() ? rng.bits(1, 0) : Philox4x32::Counter{};
  std::uint32_t lens_point =
      own_sites ? static_cast<std::uint32_t>(std::max(round, 0) * num_sites) : 0;
  const auto add = [&](const std::array<float, 2>& position) {
    const float px = static_cast<float>(x) + position[0], py = static_cast<float>(y) + position[1];
    if (!camera.has_lens()) return rays.push_back(camera.ray(px, py));
    const auto u = sobol_2d(lens_point++);
    rays.push_back(camera.ray(
        px, py, {uniform_float(u[0] ^ lens_shift[0]), uniform_float(u[1] ^ lens_shift[1])}));
  };
  const bool lone =
      num_sites == 1 && !has_fine_sites(job) && (job.quality.rounds == 1 || !own_sites);
  if (lone && job.image.filter == PixelFilter::box) return add({0.5f, 0.5f});
  const SiteGrid grid(job.image.sites, num_sites);
  const auto shift = sobol_2d(own_sites && round > 0 ? static_cast<std::uint32_t>(round) : 0);
  Philox4x32::Counter bits{};  // of two sites
  for (std::int32_t site = 0; site < num_sites; ++site) {
    if (site % 2 == 0) bits = rng.bits(0, static_cast<std::uint32_t>(site / 2));
    const auto k = static_cast<std::size_t>(site % 2 * 2);
    add(filter_position(job.image.filter, grid.position(site, uniform_float(bits[k] ^ shift[0]),
                                                        uniform_float(bits[k + 1] ^ shift[1]))));
  }
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
