#include "worker/surface/ggx_energy.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/low_discrepancy.h"
#include "common/math/philox.h"

namespace baton {
namespace {

/// What a lobe seen at some angle reflects of a white sky: F0 `head_on` + F90 `grazing`; and the
/// mean of Schlick's term under cosine-weighted light.
struct Albedo {
  float head_on = 0, grazing = 0, schlick = 0;
};

float schlick(float cosine) {
  const float t = 1 - std::clamp(cosine, 0.0f, 1.0f), t2 = t * t;
  return t2 * t2 * t;
}

/// Nodes in the square root of the cosine, where it changes fast, and in roughness.
class AlbedoTable {
 public:
  AlbedoTable() {
    for (int i = 0; i < kSide; ++i) {
      const float root = static_cast<float>(i) / (kSide - 1);
      for (int j = 0; j < kSide; ++j) {
        const float roughness = static_cast<float>(j) / (kSide - 1);
        at(i, j) = integrate(std::max(root * root, kMinCosView), roughness * roughness);
      }
    }
  }

  Albedo look_up(float cos_view, float alpha) const {
    const float x = std::sqrt(std::clamp(cos_view, 0.0f, 1.0f)) * (kSide - 1);
    const float y = std::sqrt(std::clamp(alpha, 0.0f, 1.0f)) * (kSide - 1);
    const int i = std::min(static_cast<int>(x), kSide - 2),
              j = std::min(static_cast<int>(y), kSide - 2);
    const float u = x - static_cast<float>(i), v = y - static_cast<float>(j);
    Albedo sum;
    const auto add = [&](const Albedo& a, float weight) {
      sum.head_on += weight * a.head_on;
      sum.grazing += weight * a.grazing;
      sum.schlick += weight * a.schlick;
    };
    add(at(i, j), (1 - u) * (1 - v));
    add(at(i + 1, j), u * (1 - v));
    add(at(i, j + 1), (1 - u) * v);
    add(at(i + 1, j + 1), u * v);
    return sum;
  }

 private:
  static constexpr int kSide = 32;
  static constexpr std::uint32_t kNumSamples = 256;

  Albedo& at(int i, int j) { return nodes_[static_cast<std::size_t>(i * kSide + j)]; }
  const Albedo& at(int i, int j) const { return nodes_[static_cast<std::size_t>(i * kSide + j)]; }

  /// Albedo from samples of the lobe, f cos / pdf = F G2 / G1 [Heitz 2018].
  static Albedo integrate(float cos_view, float alpha) {
    const Material lobe{.lobe = Material::Lobe::ggx,
                        .kd = {},
                        .ks = {1, 1, 1},
                        .shape = std::max(alpha, 1e-4f),
                        .specular_probability = 1};
    const Vec3 wo{std::sqrt(std::max(0.0f, 1 - cos_view * cos_view)), 0, cos_view};
    const ShadingPoint point{.position = {}, .ng = {0, 0, 1}, .ns = {0, 0, 1}, .wo = wo};
    const float view = ggx_view_masking(cos_view, lobe.shape);  // 1 + Lambda(wo)
    Albedo sum;
    for (std::uint32_t i = 0; i < kNumSamples; ++i) {
      const auto bits = sobol_2d(i);
      const float u0 = uniform_float(bits[0]), u1 = uniform_float(bits[1]);
      const Vec3 wi = sample_bsdf(lobe, point, {u0, u1, 0});
      if (wi.z > 0) {
        const float both = view + ggx_view_masking(wi.z, lobe.shape) - 1;
        const float reflected = view / both / kNumSamples;
        const float share = schlick(dot(wo, normalize(wo + wi)));
        sum.head_on += reflected * (1 - share);
        sum.grazing += reflected * share;
      }
      const float radius = std::sqrt(u0), phi = 2 * kPi * u1;
      const Vec3 cosine{radius * std::cos(phi), radius * std::sin(phi), std::sqrt(1 - u0)};
      sum.schlick += schlick(dot(wo, normalize(wo + cosine))) / kNumSamples;
    }
    return sum;
  }

  std::array<Albedo, std::size_t{kSide} * kSide> nodes_;
};

}  // namespace

Rgb diffuse_left(const Material& material, float cos_view) {
  if (material.kd == Rgb{}) return {1, 1, 1};  // metals
  static const AlbedoTable kTable;
  const Albedo albedo = kTable.look_up(cos_view, material.shape);
  const auto left = [&](float kd, float f0) {
    const float lobe = f0 * albedo.head_on + material.dielectric_f90 * albedo.grazing;
    const float color = kd / (1 - material.metallic);
    const float diffuse = color * (1 - f0) * (1 - material.dielectric_f90 * albedo.schlick);
    return diffuse > 0 ? std::clamp((1 - lobe) / diffuse, 0.0f, 1.0f) : 1.0f;
  };
  const Rgb& f0 = material.dielectric_f0;
  return {left(material.kd.x, f0.x), left(material.kd.y, f0.y), left(material.kd.z, f0.z)};
}

}  // namespace baton
