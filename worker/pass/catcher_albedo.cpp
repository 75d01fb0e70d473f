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

void CatcherAlbedo::add_catcher(SiteBlock& sites, int site, const SurfaceHit& hit) {
  const SeenSurface catcher = as_catcher(hit.point, of(hit.point.ns));
  sites.add(site, catcher.point, catcher.material);
}

}  // namespace baton
