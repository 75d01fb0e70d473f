#pragma once

#include <optional>

#include "worker/accel/geometry_sequence.h"
#include "worker/light/irradiance.h"

namespace baton {

/// The albedo pi / E(n) with which an unshadowed catcher of normal n reflects 1 in each channel, E
/// being the irradiance of one environment; 0 where no light of a colour arrives. For one thread:
/// it keeps the last answer, so that planes cost nothing.
class CatcherAlbedo {
 public:
  /// An albedo of 1: for a job without catchers, or light for which it is not needed.
  CatcherAlbedo() = default;
  /// irradiance: of the environment, may be null; both must outlive the object.
  CatcherAlbedo(const Irradiance* irradiance, const Environment& environment)
      : irradiance_(irradiance), environment_(&environment) {}

  bool is_known() const { return irradiance_ != nullptr; }
  /// Whether both have the same answers.
  bool is_like(const CatcherAlbedo& other) const {
    return irradiance_ == other.irradiance_ &&
           (!is_known() || environment_->rotation == other.environment_->rotation);
  }
  Rgb of(const Vec3& normal);
  /// Sets a site to what it hit, a catcher or not; look: of the hit, null: textures are looked up.
  /// Returns the radiance that the surface emits.
  Rgb add_to(SiteBlock& sites, int site, const FrameGeometry& geometry, const SurfaceHit& hit,
             const SurfaceShading* shading) {
    if (!hit.is_catcher) return geometry.add_to(sites, site, hit, shading);
    add_catcher(sites, site, hit);
    return {};
  }

 private:
  void add_catcher(SiteBlock& sites, int site, const SurfaceHit& hit);

  const Irradiance* irradiance_ = nullptr;
  const Environment* environment_ = nullptr;
  std::optional<Vec3> normal_;
  Rgb albedo_{1, 1, 1};  ///< albedo at normal_
};

}  // namespace baton
