#pragma once

#include <cstdint>

#include "common/scene/material/surface_detail.h"
#include "common/scene/scene.h"
#include "worker/surface/bsdf.h"

namespace baton {

/// A surface as it is lit: with its normal and its material as its textures say.
struct SeenSurface {
  ShadingPoint point;
  Material material;
  Rgb emission{};  ///< radiance to the viewer
};

/// A catcher of shadows (worker/pass/catcher.h): it blocks nothing, so light that comes from below
/// its triangle but from above the shading normal's horizon arrives, too, and without objects the
/// share is 1.
inline SeenSurface as_catcher(ShadingPoint point, const Rgb& albedo) {
  point.ng = point.ns;
  return {.point = point, .material = {.kd = albedo, .ks = {}}};
}

/// What detail makes of a surface, without the place: it is kept for as long as the place is.
struct SurfaceShading {
  Vec3 ns{};  ///< shading normal
  Rgb kd{}, ks{}, emission{};
  float shape = 1, specular_probability = 0, f90 = 1, metallic = 0;
  Material::Lobe lobe = Material::Lobe::none;
  Coat coat{};

  static SurfaceShading of(const SeenSurface& seen);
  /// At the place where it was seen. material: of the scene, for what is the same everywhere.
  SeenSurface at(const ShadingPoint& point, const Material& material) const;
};

/// The surface at a hit of `instance`, whose material has detail. point: with the normals of the
/// mesh. A mapped normal is bent just so far towards the geometric one that the viewer's mirror
/// image lies above the surface. Textures are averaged over the width of the place, which the
/// surface's slope stretches. shapes: of the frame.
SeenSurface see_detail(const Scene& scene, const Instance& instance, const SurfacePlace& place,
                       const ShadingPoint& point, const MeshShapes& shapes = {});

/// Whether a ray passes the instance, whose material is cut out, at that place: its alpha, blended
/// in the image of full size, is below the cut-off, or where the surface blends below `draw`. A
/// ray's draw, uniform in (0, 1], differs from surface to surface: the share 1 - alpha of all rays
/// passes, and each wholly or not at all.
bool is_cut_away(const Scene& scene, const Instance& instance, const SurfacePlace& place,
                 float draw);

/// `normal`, turned towards ng until wo's mirror image about it is above the surface: as shallow as
/// 0.01, or as nine tenths of wo. All unit; dot(ng, wo) >= 0.
Vec3 bent_normal(const Vec3& normal, const Vec3& ng, const Vec3& wo);

}  // namespace baton
