#pragma once

#include "worker/bounce/surface_pairs.h"
#include "worker/light/presampled_light.h"

namespace baton {

/// One candidate of a surface: where light comes from, and how much over the density of all ways to
/// draw it: reflected, and before that.
struct SurfaceCandidate {
  Vec3 direction;
  Rgb value, arriving;
  float weight = 0;  ///< mean of the value
};

/// Candidates of the light of up to kMost surfaces, by [Talbot et al. 2005]: of each a block of the
/// presampled light, and of glossy ones a direction of the BRDF, under the balance heuristic.
class SurfaceLight {
 public:
  static constexpr std::size_t kMost = 64;
  /// An eighth of the light each.
  static constexpr std::size_t kFromLight = PresampledLight::kBlock;
  /// All of a surface; of value 0 where it has none of its BRDF.
  using Candidates = std::array<SurfaceCandidate, kFromLight + 1>;

  /// Draws those of surface i, the next one of `sites`. u: of the BRDF, uniform in [0, 1).
  void add(const SiteBlock& sites, std::size_t i, const PresampledLight::Block& block,
           const std::array<float, 2>& u);
  void evaluate(const SiteBlock& sites, const EnvironmentView& light);
  /// After evaluate().
  Candidates of(const SiteBlock& sites, std::size_t i) const;

 private:
  SurfacePairs<kMost * kFromLight> from_light_;
  ColorColumns<kMost * kFromLight> radiance_;
  std::array<float, kMost * kFromLight> density_;
  SurfacePairs<kMost> own_;  ///< of the BRDF
  ColorColumns<kMost> own_radiance_;
  std::array<float, kMost> own_density_;
  std::array<std::size_t, kMost> place_of_own_;
};

}  // namespace baton
