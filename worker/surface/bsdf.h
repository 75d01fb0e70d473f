#pragma once

#include <array>

#include "common/math/vec3.h"
#include "common/scene/material/material.h"

namespace baton {

/// A surface as light sampling sees it. All directions unit, pointing away from the surface;
/// ng and ns lie on the side of wo (dot(ng, wo) >= 0, dot(ns, ng) > 0).
struct ShadingPoint {
  Vec3 position;
  Vec3 ng;  ///< geometric normal
  Vec3 ns;  ///< shading normal
  Vec3 wo;  ///< to the viewer

  bool operator==(const ShadingPoint&) const = default;
};

/// True when wi is above the shading and the geometric horizon: elsewhere every target is 0.
inline bool above_horizon(const ShadingPoint& p, const Vec3& wi) {
  return dot(p.ns, wi) > 0 && dot(p.ng, wi) > 0;
}

/// Least cosine between the shading normal and the view direction of a ggx lobe.
inline constexpr float kMinCosView = 1e-4f;

/// 1 + Lambda of Smith's masking for a ggx lobe seen at cosine cos_view > 0 [Heitz 2014].
float ggx_view_masking(float cos_view, float alpha);

/// wo, raised until ns.wo >= kMinCosView: the view direction of the ggx lobe. Interpolated normals
/// may face away from the viewer, where visible normals have no density.
Vec3 clamped_view(const ShadingPoint& point);

/// BRDF f(wi, wo) in 1/sr, without the cosine; 0 when not above_horizon. Of a coated material what
/// lies below the coat, as it is seen through it. The scalar witness of the SIMD code, with
/// evaluate_coat.
Rgb evaluate_bsdf(const Material& material, const ShadingPoint& point, const Vec3& wi);
/// BRDF of the coat times the cosine to its normal, in 1/sr, in all channels; 0 without a coat and
/// below the horizon of its or of the geometric normal.
float evaluate_coat(const Material& material, const ShadingPoint& point, const Vec3& wi);

/// A coat as a viewer sees it.
struct SeenCoat {
  /// The point with the coat's normal, and wo clamped to it.
  ShadingPoint point;
  /// Share of light that it reflects, [0, 1]; the material below keeps the rest.
  float share = 0;
};
SeenCoat see_coat(const Material& material, const ShadingPoint& point);

/// Where sample_bsdf draws from: chance of a lobe, and of these that of the coat's, each in [0, 1].
struct LobeChances {
  float any = 0, coat = 0;
};
LobeChances lobe_chances(const Material& material, float coat_share);

/// A direction from the mixture of the cosine lobe, the specular lobe and that of the coat. u: 3
/// uniforms in [0, 1). May fall below the horizon (there the BRDF is 0).
Vec3 sample_bsdf(const Material& material, const ShadingPoint& point,
                 const std::array<float, 3>& u);
/// Its density, 1/sr; integrates to 1 over the sphere.
float bsdf_pdf_solid_angle(const Material& material, const ShadingPoint& point, const Vec3& wi);

}  // namespace baton
