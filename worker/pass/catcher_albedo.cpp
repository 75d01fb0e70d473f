#include "worker/pass/catcher_albedo.h"

#include <limits>

namespace baton {

Rgb CatcherAlbedo::of(const Vec3& normal) {
  if (!is_known() || normal_ == normal) return albedo_;
  const Rgb e = irradiance_->at(*environment_, normal);
  const auto albedo = [](float received) {
    // The least that arrives keeps its inverse finite.
    return received > 4 * std::numeric_limits<float>::min() ? kPi / received : 0.0f;
  };
  normal_ = normal;
  return albedo_ = {albedo(e.x), albedo(e.y), albedo(e.z)};
}

Rgb CatcherAlbedo::add_to(SiteBlock& sites, int site, const FrameGeometry& geometry,
                          const SurfaceHit& hit, const SurfaceLook* look) {
  if (!hit.is_catcher) return geometry.add_to(sites, site, hit, look);
  const SeenSurface catcher = as_catcher(hit.point, of(hit.point.ns));
  sites.add(site, catcher.point, catcher.material);
  return {};
}

}  // namespace baton
