#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "worker/scene/site_block.h"

namespace baton {

/// Surfaces of many pixels for kernels that visit them in any order: one record of floats each, so
/// that a surface is one or two cache lines. Fields as in SiteBlock.
class SurfaceTable {
 public:
  /// Places in a record.
  enum Field : int {
    ns = 0,
    ng = 3,
    wo = 6,
    mirror = 9,
    kd = 12,
    ks = 15,
    shape = 18,
    lobe_scale,
    is_ggx,
    origin
  };
  static constexpr int kStride = 24;

  /// Appends a surface; origin: where its shadow rays start.
  void add(const ShadingPoint& point, const Material& material, const Vec3& ray_origin);
  /// Appends the surface of a site that sees nothing: it reflects nothing.
  void add_nothing() { records_.resize(records_.size() + kStride); }

  std::size_t size() const { return records_.size() / kStride; }
  const float* data() const { return records_.data(); }
  Vec3 ray_origin(std::size_t surface) const {
    const float* r = &records_[surface * kStride + origin];
    return {r[0], r[1], r[2]};
  }
  bool any_phong() const { return any_phong_; }
  bool any_ggx() const { return any_ggx_; }
  /// Texels of measured BRDFs by k, where is_ggx holds 1 + k; the first is null.
  const std::vector<const float*>& tables() const { return tables_; }

 private:
  std::vector<float> records_;
  std::vector<const float*> tables_{nullptr};
  bool any_phong_ = false;
  bool any_ggx_ = false;
};

/// Directions with the radiance that comes along them, as structure of arrays.
struct LightSamples {
  std::vector<float> x, y, z;  ///< unit
  std::vector<float> r, g, b;
  std::size_t size() const { return x.size(); }
  void resize(std::size_t count) {
    for (auto* array : {&x, &y, &z, &r, &g, &b}) array->resize(count);
  }
  /// Appends element i of another set.
  void push_back(const LightSamples& from, std::size_t i) {
    x.push_back(from.x[i]);
    y.push_back(from.y[i]);
    z.push_back(from.z[i]);
    r.push_back(from.r[i]);
    g.push_back(from.g[i]);
    b.push_back(from.b[i]);
  }
};

/// Reflected radiance per channel.
struct ReflectedSamples {
  std::vector<float> r, g, b;
  void resize(std::size_t count) {
    for (auto* array : {&r, &g, &b}) array->resize(count);
  }
};

namespace kernels {

/// (f cos L)_rgb of light sample light[i] at surface[i]; 0 below a horizon. All spans of one
/// length; `out` has that size.
void reflect_samples(const SurfaceTable& surfaces, const LightSamples& samples,
                     std::span<const std::int32_t> surface, std::span<const std::int32_t> light,
                     ReflectedSamples& out);

}  // namespace kernels
}  // namespace baton
