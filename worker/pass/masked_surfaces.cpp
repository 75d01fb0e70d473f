#include "worker/pass/masked_surfaces.h"

#include "worker/pass/cpu_clock.h"
#include "worker/pass/primary.h"

namespace baton {

MaskedSurfaces::MaskedSurfaces(const RenderContext& context, const FrameGeometry& geometry,
                               const PixelMask& mask)
    : num_sites_(static_cast<std::size_t>(context.job.image.sites)) {
  // Trace.
  const PixelRect& rect = mask.rect();
  std::int32_t count = 0;
  for (std::int32_t y = rect.y0; y < rect.y1; ++y) {
    for (std::int32_t x = rect.x0; x < rect.x1; ++x) {
      position_.push_back(mask.at(x, y) ? count++ : -1);
      if (position_.back() >= 0) append_primary_rays(context.job, geometry, x, y, rays_);
    }
  }
  hits_.resize(rays_.size());
  {
    const StageTimer timer(seconds_rays_);
    trace_primary_rays(context.job, geometry, rays_, hits_);
  }

  // Tabulate.
  for (const SurfaceHit& hit : hits_) {
    if (hit.hit) {
      table_.add(hit.point, context.scene->materials[hit.material],
                 lift_off(hit.point.position, hit.point.ng));
    } else {
      table_.add_nothing();
    }
  }
}

std::span<const SurfaceHit> MaskedSurfaces::hits(std::int32_t position) const {
  return std::span(hits_).subspan(static_cast<std::size_t>(position) * num_sites_, num_sites_);
}

Rgb MaskedSurfaces::background(std::int32_t position, const Environment& environment) const {
  const std::size_t first = static_cast<std::size_t>(position) * num_sites_;
  Rgb radiance;
  add_environment_behind(
      std::span(hits_).subspan(first, num_sites_), std::span(rays_).subspan(first, num_sites_),
      static_cast<std::int32_t>(num_sites_), view_of(environment), {&radiance, 1});
  return radiance;
}

}  // namespace baton
