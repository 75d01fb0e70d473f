#pragma once

#include "worker/integrator/kernels.h"
#include "worker/sampling/visibility_grid.h"

namespace baton {

/// How the pool of a pixel is made.
struct PoolSettings {
  std::int32_t num_carried = 16;  ///< carried particles of the pixel, even
  float gain = 2;                 ///< c of the balance between old and fresh (sampling/pool.h)
};

namespace kernels {

/// Everything that gather_pool reads. Directions of particles are relative to the environment
/// (CarriedFrame).
struct PoolInput {
  const SiteBlock& sites;
  const OldSurfaces* old;  ///< the surfaces of the particles, by sites of this frame; null where
                           ///< they are `sites`
  const Environment& now;
  const Environment& before;
  const LightPool& light_pool;
  CandidateCounts counts;  ///< fresh candidates of each half
  bool has_history = false;
  std::span<const OctDirection> code;      ///< (num_carried)
  std::span<const std::uint8_t> site;      ///< (num_carried)
  std::span<const float> contribution;     ///< (num_carried) u_j of the pixel
  std::span<const VisibilityCell> memory;  ///< (kVisibilityCells), or empty: nothing is remembered
};

/// One half of a pixel's pool: fresh candidates and then carried particles under the balance of
/// sampling/pool.h. The sum of the weights has the expectation Lns for each half by itself.
struct PoolHalf {
  static constexpr std::size_t kCapacity =
      (limits::kMaxCandidates + limits::kMaxParticles) / 2 + 4 * kPadding;
  alignas(64) OctDirection code[kCapacity];
  alignas(64) std::int32_t site[kCapacity];
  alignas(64) float x[kCapacity], y[kCapacity], z[kCapacity];  ///< world directions
  alignas(64) float weight[kCapacity];
  alignas(64) float free[kCapacity];                           ///< V^: estimated share of free rays
  alignas(64) float carry_weight[kCapacity];                   ///< weight * carry_factor(V^)
  alignas(64) float ray_weight[kCapacity];                     ///< weight * ray_factor(V^)
  alignas(64) float r[kCapacity], g[kCapacity], b[kCapacity];  ///< weight * (f cos L)_rgb / p~
  std::int32_t count = 0;
  float carry_total = 0, ray_total = 0;  ///< sums of carry_weight and ray_weight
  float lns = 0;                         ///< sum of the weights
  float lns_fresh = 0;                   ///< what the fresh candidates alone make of Lns
  float visible = 0;                     ///< sum of weight * V^
  Rgb visible_color;                     ///< sum of (r, g, b) * V^
};

/// Fills both halves of the pool; they share no sample. A black map leaves them empty.
void gather_pool(const PoolInput& input, const PoolSettings& settings, const Rng& rng,
                 std::array<PoolHalf, 2>& out);

}  // namespace kernels
}  // namespace baton
