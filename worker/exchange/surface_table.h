#pragma once

#include <cstddef>
#include <vector>

#include "worker/surface/site_block.h"

namespace baton {

/// Surfaces of many pixels for kernels that visit them in any order: two records of floats each, in
/// groups of four that kernels turn into lanes. Fields as in SiteBlock; what every surface has
/// fills a cache line, what only a glossy one has half of another.
class SurfaceTable {
 public:
  /// Places in a record: those before `wo` in the common one, the others, less `wo`, in the glossy
  /// one.
  enum Field : int {
    ns = 0,
    lobe_scale = 3,
    ng = 4,
    /// 0: diffuse or phong; 1: ggx; 1 + k: measured, with tables()[k].
    kind = 7,
    kd = 8,
    shape = 11,
    origin = 12,
    ks_r = 15,
    wo = 16,
    ks_g = 19,
    mirror = 20,
    ks_b = 23
  };
  static constexpr std::size_t kCommon = 16, kGlossy = 8;  ///< floats of a record

  /// Appends a surface; origin: where its shadow rays start.
  void add(const ShadingPoint& point, const Material& material, const Vec3& ray_origin);
  /// Appends the surface of a site that sees nothing: it reflects nothing.
  void add_nothing();
  /// Makes room for `count` surfaces in all.
  void reserve(std::size_t count);

  /// (surfaces, kCommon), from a multiple of 64 bytes.
  const float* common() const { return common_.data()->value; }
  /// (surfaces, kGlossy)
  const float* glossy() const { return glossy_.data()->value; }
  /// (surfaces, kGlossy): a coat's normal, alpha, view direction and share (SiteBlock::Coats);
  /// null: no surface has one.
  const float* coats() const { return coats_.empty() ? nullptr : coats_.data()->value; }
  /// Texels of measured BRDFs; the first is null.
  const std::vector<const float*>& tables() const { return tables_; }

 private:
  struct alignas(64) Common {
    float value[kCommon];
  };
  struct alignas(32) Glossy {
    float value[kGlossy];
  };
  std::vector<Common> common_;
  std::vector<Glossy> glossy_;
  std::vector<Glossy> coats_;  ///< one for each surface, or empty
  std::vector<const float*> tables_{nullptr};
  SiteBlock one_;  ///< the surface in work
};

}  // namespace baton
