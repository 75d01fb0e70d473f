#include "common/scene/material/material.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"

namespace baton {
namespace {

/// Share of `specular` in the reflected energy; 0 for a black material.
float specular_share(float specular, float diffuse) {
  const float sum = specular + diffuse;
  return sum > 0 ? specular / sum : 0.0f;
}

/// Over the cosine-weighted hemisphere, where Schlick's term averages to 1/21.
float mean_fresnel(const Rgb& f0, float f90) { return mean(f0) + (f90 - mean(f0)) / 21; }

float coat_roughness(const MaterialSpec& spec) {
  return spec.clearcoat_roughness.value_or(kLeastRoughness);
}

/// Reflection of what is no metal, seen head-on [KHR_materials_ior, KHR_materials_specular].
Rgb dielectric_f0(const MaterialSpec& spec) {
  const float ratio = (spec.ior - 1) / (spec.ior + 1);
  const float f0 = spec.ior == 1.5f ? 0.04f : ratio * ratio;  // 0.04 to the bit
  const Rgb tinted = spec.specular_color * f0;
  return Rgb{std::min(tinted.x, 1.0f), std::min(tinted.y, 1.0f), std::min(tinted.z, 1.0f)} *
         spec.specular;
}

}  // namespace

Material make_material(const MaterialSpec& spec) {
  return make_material(spec, spec.base_color, spec.metallic, spec.roughness);
}

Material make_material(const MaterialSpec& spec, const Rgb& base_color, float metallic,
                       float roughness) {
  switch (spec.kind) {
    case MaterialKind::diffuse:
      return {.kd = base_color, .ks = {}};
    case MaterialKind::phong: {
      const Rgb kd = base_color * spec.kd;
      const Rgb ks = spec.specular_color * spec.ks;
      return {.lobe = mean(ks) > 0 ? Material::Lobe::phong : Material::Lobe::none,
              .kd = kd,
              .ks = ks,
              .shape = spec.exponent,
              .specular_probability = specular_share(mean(ks), mean(kd))};
    }
    case MaterialKind::metallic_roughness: {
      const Rgb kd = base_color * (1 - metallic);
      const Rgb plain_f0 = dielectric_f0(spec);
      const float plain_f90 = 1 - (1 - spec.specular);  // as f90, to the bit
      const Rgb f0 = plain_f0 * (1 - metallic) + base_color * metallic;
      const float f90 = 1 - (1 - spec.specular) * (1 - metallic);
      const float fresnel = mean_fresnel(f0, f90);
      const float diffuse = mean(kd) * (1 - mean_fresnel(plain_f0, plain_f90));
      return {.lobe = Material::Lobe::ggx,
              .kd = kd,
              .ks = f0,
              .shape = roughness * roughness,
              .specular_probability = specular_share(fresnel, diffuse),
              .f90 = f90,
              .dielectric_f0 = plain_f0,
              .dielectric_f90 = plain_f90,
              .metallic = metallic,
              .coat = {.weight = spec.clearcoat.value_or(0),
                       .alpha = coat_roughness(spec) * coat_roughness(spec),
                       .base_albedo = fresnel + diffuse}};
    }
    case MaterialKind::measured:
      break;
  }
  BATON_CHECK(false);
  return {};
}

Material make_measured_material(std::shared_ptr<const MeasuredBrdf> table) {
  const MeasuredBrdf::FittedLobe lobe = table->fit_lobe();
  return {.lobe = Material::Lobe::measured,
          .kd = {},
          .ks = {},
          .shape = lobe.alpha,
          .specular_probability = lobe.share,
          .table = std::move(table)};
}

}  // namespace baton
