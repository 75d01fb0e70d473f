#pragma once

#include <cstdint>
#include <vector>

#include "common/math/octahedral.h"
#include "common/math/philox.h"
#include "worker/scene/environment_view.h"

namespace baton {

/// Directions drawn from a frame's environment before its pixels are rendered; pixels pick candidates and proposals from
/// it. One Owen-scrambled Sobol' sequence through the map's sampling table, so every aligned block is well spread by
/// itself. Each entry's direction has density `density`, so a pixel that chooses entries independently of their contents
/// stays unbiased; pixels that choose the same entries have correlated errors.
struct LightPool {
  static constexpr std::uint32_t kSize = 1u << 16;

  std::vector<OctDirection> code;     ///< (kSize) on the lattice of carried directions; empty for a black map
  std::vector<float> x, y, z;         ///< (kSize) the decoded directions
  std::vector<float> r, g, b;         ///< (kSize) radiance of this frame
  std::vector<float> density;         ///< (kSize) 1/sr
  std::vector<float> before_r, before_g, before_b;  ///< (kSize) radiance of the frame before

  bool empty() const { return code.empty(); }
  std::size_t size_bytes() const { return code.size() * 11 * sizeof(float); }
};

/// The pool of one frame. before: the environment that `before_*` is read from (the same as `now` for the first frame).
LightPool make_light_pool(const Environment& now, const Environment& before, std::uint64_t job_seed,
                          std::uint32_t frame);

}  // namespace baton
