#pragma once

#include <array>
#include <memory>

#include "common/job/job_spec.h"
#include "common/math/vec3.h"
#include "worker/scene/measured_brdf.h"

namespace baton {

struct SurfaceDetail;

/// A clear layer of index 1.5 over a material [KHR_materials_clearcoat]: f = (1 - s) f_below + s D
/// G2 / (4 |n.wi| |n.wo|), with the share s of what it reflects = weight times Schlick's term of
/// F0 = 0.04 and n.wo. It reflects no more than it receives if the material below does not.
struct Coat {
  float weight = 0;       ///< [0, 1]; 0: none
  float alpha = 1;        ///< roughness^2
  Vec3 normal{};          ///< unit; 0: the shading normal
  float base_albedo = 0;  ///< about what the material below reflects, [0, 1]; for sampling alone
};

/// A material in the one form that all code evaluates. lobe measured: f is the table. Else:
///   f = kd/pi [* (1 - F) for ggx] + specular lobe,
/// lobe phong: ks (s+2)/(2 pi) max(0, r.wi)^s, r the mirror direction of wo about the shading
/// normal
///   [Lafortune & Willems 1994; the papers' model];
/// lobe ggx: D G2 F / (4 |n.wi| |n.wo|), F Schlick from F0 = ks to f90 [glTF 2.0, appendix B;
/// KHR_materials_specular]; the diffuse part takes f90 as 1. As published, a white and smooth
///   dielectric gains energy at grazing view (albedo 1.03 at 60, 1.6 at 85 degrees); a metal never
///   does.
struct Material {
  enum class Lobe : std::uint8_t { none, phong, ggx, measured };

  Lobe lobe = Lobe::none;
  Rgb kd;                          ///< diffuse albedo
  Rgb ks;                          ///< phong: specular albedo; ggx: F0
  float shape = 1;                 ///< phong: exponent s; ggx: alpha = roughness^2
  float specular_probability = 0;  ///< chance of the lobe in sample_bsdf, without a coat, [0, 1]
  std::shared_ptr<const MeasuredBrdf>
      table{};    ///< measured: the whole BRDF; kd and ks are 0, shape is the sampled lobe's alpha
  float f90 = 1;  ///< ggx
  /// What differs from place to place, glows or is not there (surface_detail.h); null: nothing. The
  /// rest is then only what methods look at ahead.
  std::shared_ptr<const SurfaceDetail> detail{};
  Coat coat{};  ///< ggx
};

/// Material of a specification of any kind but `measured`. specular_probability follows from the
/// mean albedos.
Material make_material(const MaterialSpec& spec);
/// The same with other numbers than the specification's.
Material make_material(const MaterialSpec& spec, const Rgb& base_color, float metallic,
                       float roughness);
/// Evaluates the table; samples and densities are those of the GGX lobe that resembles its peak,
/// and of the cosine lobe.
Material make_measured_material(std::shared_ptr<const MeasuredBrdf> table);

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

/// Least roughness of a ggx lobe; what the schema of jobs takes.
inline constexpr float kLeastRoughness = 0.02f;

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
  ShadingPoint point;  ///< with the coat's normal, and wo clamped to it
  float share = 0;     ///< of light that it reflects, [0, 1]; the material below keeps the rest
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
