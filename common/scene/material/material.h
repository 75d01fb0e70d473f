#pragma once

#include <array>
#include <memory>

#include "common/job/job_spec.h"
#include "common/math/vec3.h"
#include "common/scene/material/measured_brdf.h"

namespace baton {

/// Least roughness of a ggx lobe; what the schema of jobs takes.
inline constexpr float kLeastRoughness = 0.02f;

struct SurfaceDetail;

/// A clear layer of index 1.5 over a material [KHR_materials_clearcoat]: f = (1 - s) f_below + s D
/// G2 / (4 |n.wi| |n.wo|), with the share s of what it reflects = weight times Schlick's term of
/// F0 = 0.04 and n.wo. It reflects no more than it receives if the material below does not.
struct Coat {
  float weight = 0;  ///< [0, 1]; 0: none
  float alpha = 1;   ///< roughness^2
  Vec3 normal{};     ///< unit; 0: the shading normal
  /// About what the material below reflects, [0, 1]; for sampling alone.
  float base_albedo = 0;
};

/// A material in the one form that all code evaluates. lobe measured: f is the table. Else:
///   f = kd/pi [* (1 - F) of what is no metal, for ggx] + specular lobe,
/// lobe phong: ks (s+2)/(2 pi) max(0, r.wi)^s, r the mirror direction of wo about the shading
/// normal
///   [Lafortune & Willems 1994; the papers' model];
/// lobe ggx: D G2 F / (4 |n.wi| |n.wo|), F Schlick from F0 = ks to f90 [KHR_materials_specular]. A
///   metal and what is none are mixed by `metallic` [glTF 2.0, appendix B.2]: as both have one D
///   and G2, the mix has one lobe, with the means of their F0 and F90; the diffuse part gives way
///   to the lobe of what is no metal alone. As published, a white and smooth dielectric gains
///   energy at grazing view (albedo 1.03 at 60, 1.6 at 85 degrees); a metal never does.
struct Material {
  enum class Lobe : std::uint8_t { none, phong, ggx, measured };

  Lobe lobe = Lobe::none;
  Rgb kd;  ///< diffuse albedo
  Rgb ks;  ///< phong: specular albedo; ggx: F0
  /// Phong: exponent s; ggx: alpha = roughness^2.
  float shape = 1;
  /// Chance of the lobe in sample_bsdf, without a coat, [0, 1].
  float specular_probability = 0;
  /// Measured: the whole BRDF; kd and ks are 0, shape is the sampled lobe's alpha.
  std::shared_ptr<const MeasuredBrdf> table{};
  float f90 = 1;  ///< ggx
  /// ggx: F0 and F90 of what is no metal; the same wherever a material is.
  Rgb dielectric_f0{};
  float dielectric_f90 = 1;
  float metallic = 0;  ///< ggx: share of metal, in kd already
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

}  // namespace baton
