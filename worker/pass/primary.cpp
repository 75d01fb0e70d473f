#include "worker/pass/primary.h"

#include <cmath>

namespace baton {
namespace {

/// Position of a site inside its pixel, [0, 1)^2.
std::array<float, 2> site_position(const JobSpec& job, std::uint32_t pixel, std::int32_t site) {
  if (job.image.sites == 1) return {0.5f, 0.5f};
  const auto side = static_cast<std::int32_t>(std::lround(std::sqrt(static_cast<double>(job.image.sites))));
  const Rng rng({.job_seed = job.seed, .frame = 0, .pixel = pixel}, PassId::site_position);
  const auto u = rng.uniforms(0, static_cast<std::uint32_t>(site));
  const auto cell = 1.0f / static_cast<float>(side);
  return {(static_cast<float>(site % side) + u[0]) * cell, (static_cast<float>(site / side) + u[1]) * cell};
}

}  // namespace

TileSurfaces trace_primary(const JobSpec& job, const FrameGeometry& geometry,
                           const PixelRect& rect) {
  TileSurfaces surfaces{.rect = rect, .num_sites = job.image.sites, .hits = {}, .rays = {}};
  surfaces.rays.reserve(static_cast<std::size_t>(rect.area() * job.image.sites));
  for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
    for (std::int32_t x = rect.x0; x < rect.x1; ++x) {
      append_primary_rays(job, geometry, x, y, surfaces.rays);
    }
  }
  surfaces.hits.resize(surfaces.rays.size());
  trace_primary_rays(job, geometry, surfaces.rays, surfaces.hits);
  return surfaces;
}

void append_primary_rays(const JobSpec& job, const FrameGeometry& geometry, std::int32_t x,
                         std::int32_t y, std::vector<Ray>& rays) {
  const auto pixel = static_cast<std::uint32_t>(y * job.image.width + x);
  for (std::int32_t site = 0; site < job.image.sites; ++site) {
    const auto [dx, dy] = site_position(job, pixel, site);
    rays.push_back(
        geometry.pose.camera.ray(static_cast<float>(x) + dx, static_cast<float>(y) + dy));
  }
}

void trace_primary_rays(const JobSpec& job, const FrameGeometry& geometry,
                        std::span<const Ray> rays, std::span<SurfaceHit> hits) {
  geometry.accel->intersect(rays, hits, static_cast<std::size_t>(job.image.sites));
}

Rgb environment_behind(std::span<const SurfaceHit> hits, std::span<const Ray> rays, const Environment& environment) {
  Rgb sum;
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (hits[s].hit) continue;
    const EnvironmentMap::Texel seen = environment.evaluate(rays[s].direction);
    sum += Rgb{seen.r, seen.g, seen.b} / static_cast<float>(hits.size());
  }
  return sum;
}

}  // namespace baton
