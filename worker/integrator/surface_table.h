#pragma once

#include <cstddef>
#include <vector>

#include "worker/scene/site_block.h"

namespace baton {

/// Surfaces of many pixels for kernels that visit them in any order: one record of floats each, in
/// groups of four that kernels turn into lanes. Fields as in SiteBlock; what every surface has
/// comes first, what only a glossy one has last.
class SurfaceTable {
 public:
  /// Places in a record.
  enum Field : int {
    ns = 0,
    lobe_scale = 3,
    ng = 4,
    kind = 7,  ///< 0: diffuse or phong; 1: ggx; 1 + k: measured, with tables()[k]
    kd = 8,
    shape = 11,
    origin = 12,
    ks_r = 15,
    wo = 16,
    ks_g = 19,
    mirror = 20,
    ks_b = 23
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
  /// Texels of measured BRDFs; the first is null.
  const std::vector<const float*>& tables() const { return tables_; }

 private:
  std::vector<float> records_;
  std::vector<const float*> tables_{nullptr};
  SiteBlock one_;  ///< the surface in work
};

}  // namespace baton
