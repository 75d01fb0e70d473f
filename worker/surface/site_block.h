#pragma once

#include <array>
#include <cstdint>

#include "common/base/limits.h"
#include "worker/surface/bsdf.h"

namespace baton {

/// The surfaces that the sites of one pixel see, as structure of arrays for the SIMD kernels.
/// Index: site, [0, S). A site without a surface has zero reflectance, so its target is 0
/// everywhere.
struct alignas(64) SiteBlock {
  static constexpr int kMaxSites = limits::kMaxFineSites;
  /// A cache line more, so that the same site of several arrays is not in one set of a cache.
  using Array = std::array<float, kMaxSites + 16>;

  Array ns_x{}, ns_y{}, ns_z{};  ///< shading normal
  Array ng_x{}, ng_y{}, ng_z{};  ///< geometric normal
  Array wo_x{}, wo_y{}, wo_z{};  ///< to the viewer
  /// Phong: wo mirrored about ns; ggx: x is F90 of what is no metal.
  Array mirror_x{}, mirror_y{}, mirror_z{};
  /// Diffuse albedo; ggx: kd (1 - F0 of what is no metal) diffuse_left().
  Array kd_r{}, kd_g{}, kd_b{};
  Array ks_r{}, ks_g{}, ks_b{};  ///< phong: specular albedo; ggx: F0
  Array shape{};                 ///< phong: exponent; ggx: alpha
  /// Phong: (s + 2) / (2 pi); ggx: F90; measured: 0.
  Array lobe_scale{};
  Array specular_probability{};  ///< LobeChances::any
  Array alpha2{};                ///< ggx: alpha^2
  Array view_cosine{};           ///< ggx: n.wo, at least 1e-4
  Array view_masking{};          ///< ggx: 1 + Lambda(wo) [Heitz 2014]
  /// 1 for ggx, and for measured, which is sampled by such a lobe; else 0.
  Array is_ggx{};
  std::array<const float*, kMaxSites> measured{};  ///< texels of a MeasuredBrdf, or null

  /// Clear coats, all 0 where a site has none. Only what any_coat says is there is read.
  struct Coats {
    Array ns_x{}, ns_y{}, ns_z{};  ///< the coat's normal
    /// To the viewer, as a ggx lobe about it has it.
    Array wo_x{}, wo_y{}, wo_z{};
    Array alpha{};
    /// SeenCoat::share; kd and ks hold what it leaves.
    Array share{};
    Array chance{};  ///< LobeChances::coat

    /// No coats on the first `sites` sites.
    void clear(int sites);
  };
  Coats coats;

  std::int32_t num_sites = 1;  ///< S
  std::int32_t num_hits = 0;   ///< sites that see a surface
  /// Number of sites whose surface has a lobe beside the diffuse one.
  std::int32_t num_lobes = 0;
  std::array<std::int32_t, kMaxSites> hit_sites{};   ///< their indices, ascending
  std::array<std::int32_t, kMaxSites> lobe_sites{};  ///< their indices, ascending
  /// specular_probability of all sites that see a surface.
  float specular_sum = 0;
  bool any_phong = false;
  bool any_ggx = false;
  bool any_measured = false;
  bool any_coat = false;

  /// Starts anew with `sites` in [1, kMaxSites]; each must then be added, in ascending order, with
  /// add or add_miss.
  void clear(int sites);
  /// Sets site `site` to a surface.
  void add(int site, const ShadingPoint& point, const Material& material);
  /// Sets site `site` to what site `other` of another block is, a surface.
  void add_copy(int site, const SiteBlock& from, int other);
  /// Sets site `site` to nothing.
  void add_miss(int site);

 private:
  void add_coat(std::size_t site, const ShadingPoint& point, const Material& material);
};

}  // namespace baton
