#pragma once

#include <cstdint>
#include <vector>

#include "common/math/octahedral.h"
#include "common/math/philox.h"
#include "worker/scene/environment_view.h"

namespace baton {

/// Directions drawn from a frame's environment before its pixels are rendered; pixels pick
/// candidates and proposals from it. One Owen-scrambled Sobol' sequence through the map's sampling
/// table, so every aligned block is well spread by itself (blocks of eight are shuffled within).
/// Each entry's direction has density `density`, so a pixel that chooses entries independently of
/// their contents stays unbiased; pixels that choose the same entries have correlated errors.
struct LightPool {
  static constexpr std::uint32_t kSize = 1u
                                         << 13;  ///< entries: few enough to stay in a core's cache
  static constexpr std::uint32_t kBlock = 8;     ///< entries that lie together in memory

  /// Eight entries, field by field: the unit of SIMD loads.
  struct alignas(64) Block {
    OctDirection code[kBlock];              ///< on the lattice of carried directions
    float x[kBlock], y[kBlock], z[kBlock];  ///< the decoded directions
    float r[kBlock], g[kBlock], b[kBlock];  ///< radiance of this frame
    float density[kBlock];                  ///< 1/sr
    float inverse_density[kBlock];          ///< sr; 0 where the density is
    float before_r[kBlock], before_g[kBlock], before_b[kBlock];  ///< radiance of the frame before
  };
  std::vector<Block> blocks;  ///< (kSize / kBlock); empty for a black map

  bool empty() const { return blocks.empty(); }
  std::size_t size_bytes() const { return blocks.size() * sizeof(Block); }
};

/// What carried directions are relative to: the world, or the environment, with which they then
/// turn.
enum class CarriedFrame { world, environment };

/// The pool of one frame. before: the environment that `before_*` is read from (the same as `now`
/// for the first frame). carried: what `code` and the `before_*` of a direction are relative to;
/// x, y, z are world directions in either case.
LightPool make_light_pool(const Environment& now, const Environment& before, std::uint64_t job_seed,
                          std::uint32_t frame, CarriedFrame carried = CarriedFrame::world);

}  // namespace baton
