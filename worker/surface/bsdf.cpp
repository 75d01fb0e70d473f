#include "worker/surface/bsdf.h"

#include <algorithm>
#include <cmath>

#include "worker/surface/ggx_energy.h"

namespace baton {
namespace {

constexpr float kTwoPi = 2 * kPi;
/// What a coat of index 1.5 reflects head-on.
constexpr float kCoatF0 = 0.04f;

/// cos^s of the angle between unit a and b, 0 past a right angle. 1 - cos = |a - b|^2 / 2 keeps its
/// digits where the cosine has lost them, so s = 100000 is as exact as s = 1.
float cosine_power(const Vec3& a, const Vec3& b, float s) {
  const Vec3 d = a - b;
  const float one_minus_cos = 0.5f * dot(d, d);
  return one_minus_cos < 1 ? std::exp(s * std::log1p(-one_minus_cos)) : 0.0f;
}

/// GGX normal distribution D = a^2 / (pi (a^2 (n.h)^2 + |n x h|^2)^2), 1/sr. The cross product
/// keeps the digits that 1 - (n.h)^2 loses for a near 0.
float ggx_distribution(const Vec3& n, const Vec3& h, float alpha) {
  const Vec3 c = cross(n, h);
  const float cos_h = dot(n, h);
  const float alpha2 = alpha * alpha;
  const float t = alpha2 * cos_h * cos_h + dot(c, c);
  return alpha2 / (kPi * t * t);
}

/// sqrt(a^2 + (1 - a^2) cos^2): the root in Smith's masking function of GGX.
float smith_root(float cos_theta, float alpha) {
  const float alpha2 = alpha * alpha;
  return std::sqrt(alpha2 + (1 - alpha2) * cos_theta * cos_theta);
}

/// D G2 / (4 n.wi n.wo). G2 / (4 n.wi n.wo) of the height-correlated Smith function [Heitz 2014,
/// eq. 99] is 1 / (2 (n.wi root(n.wo) + n.wo root(n.wi))): nothing divides by n.wi. h: unit,
/// between wi and wo.
float ggx_lobe(float alpha, const Vec3& n, const Vec3& h, float cos_i, float cos_o) {
  const float masking_over_4 =
      0.5f / (cos_i * smith_root(cos_o, alpha) + cos_o * smith_root(cos_i, alpha));
  return ggx_distribution(n, h, alpha) * masking_over_4;
}

/// Specular and diffuse part of ggx.
Rgb evaluate_ggx(const Material& m, const ShadingPoint& p, const Vec3& wi) {
  const Vec3 wo = clamped_view(p);
  const Vec3 h = normalize(wi + wo);
  const float cos_i = dot(p.ns, wi);
  const float cos_o = std::max(dot(p.ns, wo), kMinCosView);
  const float specular = ggx_lobe(m.shape, p.ns, h, cos_i, cos_o);
  const float t = 1 - std::clamp(dot(wo, h), 0.0f, 1.0f);
  const float t2 = t * t;
  const float grazing = t2 * t2 * t;
  const Rgb fresnel = m.ks + (Rgb{m.f90, m.f90, m.f90} - m.ks) * grazing;
  const Rgb kept = (Rgb{1, 1, 1} - m.dielectric_f0) * (1 - m.dielectric_f90 * grazing);
  const Rgb diffuse = kept * m.kd * diffuse_left(m, cos_o);
  return diffuse * kInvPi + fresnel * specular;
}

/// Density of the reflected visible normal, D G1(wo) / (4 n.wo), with G1 / n.wo = 2 / (n.wo +
/// root(n.wo)).
float ggx_pdf(float alpha, const ShadingPoint& p, const Vec3& wi) {
  const Vec3 wo = clamped_view(p);
  const Vec3 sum = wi + wo;
  if (!(dot(sum, p.ns) > 0)) return 0;
  const float cos_o = std::max(dot(p.ns, wo), kMinCosView);
  return ggx_distribution(p.ns, normalize(sum), alpha) * 0.5f / (cos_o + smith_root(cos_o, alpha));
}

/// wo mirrored at a visible normal, drawn through a spherical cap [Dupuy & Benyoub 2023, listing
/// 1].
Vec3 sample_ggx(float alpha, const ShadingPoint& p, float u0, float u1) {
  const Frame frame(p.ns);
  const Vec3 wo = clamped_view(p);
  const Vec3 local = frame.to_local(wo);
  const Vec3 stretched = normalize({local.x * alpha, local.y * alpha, std::max(local.z, 0.0f)});

  // Draw on the cap z > -stretched.z; the sum with the view direction is the hemisphere's visible
  // normal.
  const float phi = kTwoPi * u0;
  const float z_plus_view = (1 - u1) * (1 + stretched.z);
  const float z = std::clamp(z_plus_view - stretched.z, -1.0f, 1.0f);
  const float sin_theta = std::sqrt((1 - z) * (1 + z));
  const Vec3 h{(sin_theta * std::cos(phi) + stretched.x) * alpha,
               (sin_theta * std::sin(phi) + stretched.y) * alpha, z_plus_view};
  return normalize(reflect(wo, frame.to_world(normalize(h))));
}

/// Cosine-power lobe about the mirror direction.
Vec3 sample_phong(const Material& m, const ShadingPoint& p, float u0, float u1) {
  const float one_minus_cos = -std::expm1(std::log1p(-u1) / (m.shape + 1));
  const float sin_theta = std::sqrt(one_minus_cos * (2 - one_minus_cos));
  const float phi = kTwoPi * u0;
  const Frame frame(normalize(reflect(p.wo, p.ns)));
  return normalize(
      frame.to_world({sin_theta * std::cos(phi), sin_theta * std::sin(phi), 1 - one_minus_cos}));
}

/// Cosine lobe about the shading normal.
Vec3 sample_cosine(const ShadingPoint& p, float u0, float u1) {
  const float radius = std::sqrt(u1);
  const float phi = kTwoPi * u0;
  return normalize(
      Frame(p.ns).to_world({radius * std::cos(phi), radius * std::sin(phi), std::sqrt(1 - u1)}));
}

/// Density of the specular lobe alone, 1/sr.
float lobe_pdf(const Material& m, const ShadingPoint& p, const Vec3& wi) {
  switch (m.lobe) {
    case Material::Lobe::none:
      return 0;
    case Material::Lobe::phong:
      return (m.shape + 1) / kTwoPi * cosine_power(normalize(reflect(p.wo, p.ns)), wi, m.shape);
    case Material::Lobe::ggx:
    case Material::Lobe::measured:
      return ggx_pdf(m.shape, p, wi);
  }
  return 0;
}

}  // namespace

float ggx_view_masking(float cos_view, float alpha) {
  return 0.5f + 0.5f * smith_root(cos_view, alpha) / cos_view;
}

Vec3 clamped_view(const ShadingPoint& point) {
  const float cos_view = dot(point.ns, point.wo);
  if (cos_view >= kMinCosView) return point.wo;
  return normalize(point.wo + point.ns * (kMinCosView - cos_view));
}

namespace {

/// evaluate_bsdf without a coat, where it is not 0.
Rgb evaluate_base(const Material& material, const ShadingPoint& point, const Vec3& wi) {
  switch (material.lobe) {
    case Material::Lobe::none:
      return material.kd * kInvPi;
    case Material::Lobe::phong: {
      const Vec3 mirror = normalize(reflect(point.wo, point.ns));
      return material.kd * kInvPi + material.ks * ((material.shape + 2) / kTwoPi *
                                                   cosine_power(mirror, wi, material.shape));
    }
    case Material::Lobe::ggx:
      return evaluate_ggx(material, point, wi);
    case Material::Lobe::measured:
      return material.table->evaluate(point.ns, wi, clamped_view(point));
  }
  return {};
}

}  // namespace

Rgb evaluate_bsdf(const Material& material, const ShadingPoint& point, const Vec3& wi) {
  if (!above_horizon(point, wi)) return {};
  const Rgb f = evaluate_base(material, point, wi);
  return material.coat.weight > 0 ? f * (1 - see_coat(material, point).share) : f;
}

float evaluate_coat(const Material& material, const ShadingPoint& point, const Vec3& wi) {
  if (!(material.coat.weight > 0)) return 0;
  const SeenCoat coat = see_coat(material, point);
  const ShadingPoint& p = coat.point;
  if (!above_horizon(p, wi)) return 0;
  const float cos_i = dot(p.ns, wi);
  const float cos_o = std::max(dot(p.ns, p.wo), kMinCosView);
  return coat.share * cos_i *
         ggx_lobe(material.coat.alpha, p.ns, normalize(wi + p.wo), cos_i, cos_o);
}

SeenCoat see_coat(const Material& material, const ShadingPoint& point) {
  SeenCoat coat{point};
  if (!(material.coat.weight > 0)) return coat;
  if (!(material.coat.normal == Vec3{})) coat.point.ns = material.coat.normal;
  coat.point.wo = clamped_view(coat.point);
  const float t = 1 - std::clamp(dot(coat.point.ns, coat.point.wo), 0.0f, 1.0f), t2 = t * t;
  coat.share = material.coat.weight * (kCoatF0 + (1 - kCoatF0) * t2 * t2 * t);
  return coat;
}

LobeChances lobe_chances(const Material& material, float coat_share) {
  if (!(coat_share > 0)) return {material.specular_probability, 0};
  const float below = (1 - coat_share) * material.coat.base_albedo;
  const float lobes = coat_share + below * material.specular_probability;
  return {lobes / (coat_share + below), coat_share / lobes};
}

Vec3 sample_bsdf(const Material& material, const ShadingPoint& point,
                 const std::array<float, 3>& u) {
  const SeenCoat coat = see_coat(material, point);
  const LobeChances chance = lobe_chances(material, coat.share);
  if (u[2] >= chance.any) return sample_cosine(point, u[0], u[1]);
  if (u[2] < chance.any * chance.coat)
    return sample_ggx(material.coat.alpha, coat.point, u[0], u[1]);
  return material.lobe == Material::Lobe::phong ? sample_phong(material, point, u[0], u[1])
                                                : sample_ggx(material.shape, point, u[0], u[1]);
}

float bsdf_pdf_solid_angle(const Material& material, const ShadingPoint& point, const Vec3& wi) {
  const float cosine = std::max(dot(point.ns, wi), 0.0f) * kInvPi;
  const SeenCoat coat = see_coat(material, point);
  const LobeChances chance = lobe_chances(material, coat.share);
  const float p = chance.any;
  float lobes = lobe_pdf(material, point, wi);
  if (chance.coat > 0)
    lobes += chance.coat * (ggx_pdf(material.coat.alpha, coat.point, wi) - lobes);
  return (1 - p) * cosine + p * lobes;
}

}  // namespace baton
