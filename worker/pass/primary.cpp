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

/// Position of a site inside its pixel, [0, 1)^2, from two uniforms; side: sites in a row.
std::array<float, 2> site_position(std::int32_t site, std::int32_t side, float u, float v) {
  const auto cell = 1.0f / static_cast<float>(side);
  return {(static_cast<float>(site % side) + u) * cell,
          (static_cast<float>(site / side) + v) * cell};
}

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
  return trace_primary(job, geometry, rect, RoundPixels::all(static_cast<std::size_t>(rect.area())),
                       round);
}

TileSurfaces trace_primary(const JobSpec& job, const FrameGeometry& geometry, const PixelRect& rect,
                           RoundPixels pixels, std::int32_t round) {
  TileSurfaces surfaces{.rect = rect,
                        .pixels = std::move(pixels),
                        .num_sites = job.image.sites,
                        .hits = {},
                        .rays = {},
                        .looks = {},
                        .first_site = {}};
  const std::size_t count = surfaces.pixels.size();
  surfaces.rays.reserve(count * static_cast<std::size_t>(job.image.sites));
  for (std::size_t slot = 0; slot < count; ++slot) {
    const auto [x, y] = rect.place(surfaces.pixels.index(slot));
    append_primary_rays(job, geometry, x, y, surfaces.rays, round);
  }
  surfaces.hits.resize(surfaces.rays.size());
  trace_primary_rays(job, geometry, surfaces.rays, surfaces.hits);
  for (std::size_t slot = 0; slot < count; ++slot) {
    const std::span<const SurfaceHit> hits = surfaces.pixel(slot);
    const auto first =
        std::find_if(hits.begin(), hits.end(), [](const SurfaceHit& hit) { return hit.hit; });
    surfaces.first_site.push_back(static_cast<std::uint8_t>(first - hits.begin()));
  }
  if (geometry.scene->has_detail) surfaces.looks = looks_of(geometry, surfaces.hits);
  return surfaces;
}

TileSurfaces part_of(const TileSurfaces& whole, RoundPixels pixels) {
  TileSurfaces part{.rect = whole.rect,
                    .pixels = std::move(pixels),
                    .num_sites = whole.num_sites,
                    .hits = {},
                    .rays = {},
                    .looks = {},
                    .first_site = {}};
  const auto num_sites = static_cast<std::ptrdiff_t>(whole.num_sites);
  part.hits.reserve(part.pixels.size() * static_cast<std::size_t>(num_sites));
  part.rays.reserve(part.hits.capacity());
  for (std::size_t slot = 0; slot < part.pixels.size(); ++slot) {
    const std::size_t index = part.pixels.index(slot);
    const auto first = static_cast<std::ptrdiff_t>(index) * num_sites;
    part.hits.insert(part.hits.end(), whole.hits.begin() + first,
                     whole.hits.begin() + first + num_sites);
    part.rays.insert(part.rays.end(), whole.rays.begin() + first,
                     whole.rays.begin() + first + num_sites);
    if (!whole.looks.empty())
      part.looks.insert(part.looks.end(), whole.looks.begin() + first,
                        whole.looks.begin() + first + num_sites);
    part.first_site.push_back(whole.first_site[index]);
  }
  return part;
}

void append_primary_rays(const JobSpec& job, const FrameGeometry& geometry, std::int32_t x,
                         std::int32_t y, std::vector<Ray>& rays, std::int32_t round) {
  const Camera& camera = geometry.pose.camera;
  const std::uint64_t seed = job.image.site_seed > 0 ? job.image.site_seed : job.seed;
  const Rng rng(pixel_key(seed, 0, job.image.width, x, y), PassId::site_position);
  const bool own_sites = rounds_have_own_sites(job);
  const Philox4x32::Counter lens_shift = camera.has_lens() ? rng.bits(1, 0) : Philox4x32::Counter{};
  std::uint32_t lens_point =
      own_sites ? static_cast<std::uint32_t>(std::max(round, 0) * job.image.sites) : 0;
  const auto add = [&](const std::array<float, 2>& position) {
    const float px = static_cast<float>(x) + position[0], py = static_cast<float>(y) + position[1];
    if (!camera.has_lens()) return rays.push_back(camera.ray(px, py));
    const auto u = sobol_2d(lens_point++);
    rays.push_back(camera.ray(
        px, py, {uniform_float(u[0] ^ lens_shift[0]), uniform_float(u[1] ^ lens_shift[1])}));
  };
  const bool lone = job.image.sites == 1 && (job.quality.rounds == 1 || !own_sites);
  if (lone && job.image.filter == PixelFilter::box) return add({0.5f, 0.5f});
  const auto side = static_cast<std::int32_t>(std::sqrt(static_cast<float>(job.image.sites)));
  const auto shift = sobol_2d(own_sites && round > 0 ? static_cast<std::uint32_t>(round) : 0);
  Philox4x32::Counter bits{};  // of two sites
  for (std::int32_t site = 0; site < job.image.sites; ++site) {
    if (site % 2 == 0) bits = rng.bits(0, static_cast<std::uint32_t>(site / 2));
    const auto k = static_cast<std::size_t>(site % 2 * 2);
    add(filter_position(job.image.filter,
                        site_position(site, side, uniform_float(bits[k] ^ shift[0]),
                                      uniform_float(bits[k + 1] ^ shift[1]))));
  }
}

void trace_primary_rays(const JobSpec& job, const FrameGeometry& geometry,
                        std::span<const Ray> rays, std::span<SurfaceHit> hits) {
  geometry.accel->intersect(rays, hits, static_cast<std::size_t>(job.image.sites));
  see_catchers(geometry, static_cast<std::size_t>(job.image.sites), rays, hits);
  if (!geometry.scene->has_detail) return;
  const float share = 1 / std::sqrt(static_cast<float>(job.image.sites));
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].hit || geometry.material_of(hits[i]).detail == nullptr) continue;
    const float pixel = geometry.pose.camera.pixel_width(rays[i].direction, hits[i].depth);
    hits[i].place.width = share * pixel;
  }
}

void add_environment_behind(std::span<const SurfaceHit> hits, std::span<const Ray> rays,
                            std::int32_t num_sites, const EnvironmentView& environment,
                            std::span<Rgb> radiance) {
  constexpr std::size_t kBatch = 64;
  std::array<float, kBatch> x, y, z, r, g, b;
  std::array<std::size_t, kBatch> pixel;
  const float share = 1.0f / static_cast<float>(num_sites);
  std::size_t count = 0;
  const auto flush = [&] {
    const auto used = [count](std::array<float, kBatch>& array) {
      return std::span(array).first(count);
    };
    kernels::see_environment(environment, used(x), used(y), used(z), used(r), used(g), used(b));
    for (std::size_t i = 0; i < count; ++i) radiance[pixel[i]] += Rgb{r[i], g[i], b[i]} * share;
    count = 0;
  };
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (hits[s].hit && !hits[s].is_catcher) continue;
    pixel[count] = s / static_cast<std::size_t>(num_sites);
    x[count] = rays[s].direction.x;
    y[count] = rays[s].direction.y;
    z[count] = rays[s].direction.z;
    if (++count == kBatch) flush();
  }
  flush();
}

}  // namespace baton
