#include "worker/exchange/masked_surfaces.h"

#include "common/base/cpu_clock.h"
#include "worker/pass/primary.h"
#include "worker/pass/site_rays.h"

namespace baton {

MaskedSurfaces::MaskedSurfaces(const RenderContext& context, const FrameGeometry& geometry,
                               const PixelMask& mask)
    : num_sites_(static_cast<std::size_t>(context.job.image.sites)), position_(mask.ranks()) {
  // Trace.
  SiteRays sites(context.job, geometry.pose.camera, 0);
  mask.visit_all(
      [&](std::int32_t x, std::int32_t y) { sites.append(x, y, context.job.image.sites, rays_); });
  hits_.resize(rays_.size());
  {
    const StageTimer timer(seconds_rays_);
    const std::vector<std::uint16_t> num_sites(rays_.size() / num_sites_,
                                               static_cast<std::uint16_t>(num_sites_));
    trace_primary_rays(geometry, rays_, num_sites, hits_);
  }

  // Tabulate.
  table_.reserve(hits_.size());
  emission_.resize(hits_.size() / num_sites_);
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    if (!hits_[i].hit) {
      table_.add_nothing();
      continue;
    }
    const SeenSurface seen = geometry.see(hits_[i]);
    table_.add(seen.point, seen.material, hits_[i].ray_origin);
    emission_[i / num_sites_] += seen.emission / static_cast<float>(num_sites_);
  }
}

std::span<const SurfaceHit> MaskedSurfaces::hits(std::int32_t position) const {
  return std::span(hits_).subspan(static_cast<std::size_t>(position) * num_sites_, num_sites_);
}

Rgb MaskedSurfaces::background(std::int32_t position, const Environment& environment) const {
  const std::size_t first = static_cast<std::size_t>(position) * num_sites_;
  Rgb radiance;
  const EnvironmentView view = view_of(environment);
  EnvironmentBehind behind(view, {&radiance, 1});
  behind.add(0, hits(position), std::span(rays_).subspan(first, num_sites_));
  behind.flush();
  return radiance;
}

}  // namespace baton
