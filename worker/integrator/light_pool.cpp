#include "worker/integrator/light_pool.h"

#include "common/math/low_discrepancy.h"
#include "worker/integrator/kernels.h"

namespace baton {

LightPool make_light_pool(const Environment& now, const Environment& before, std::uint64_t job_seed,
                          std::uint32_t frame) {
  LightPool pool;
  if (now.map->black()) return pool;
  pool.blocks.resize(LightPool::kSize / LightPool::kBlock);
  const EnvironmentView now_view = view_of(now);
  const EnvironmentView before_view = view_of(before);
  const Rng rng({.job_seed = job_seed, .frame = frame, .pixel = 0}, PassId::light_pool);
  const Philox4x32::Counter seeds = rng.bits(0, 0);
  std::uint32_t index = 0;
  for (LightPool::Block& block : pool.blocks) {
    // Draw the directions and put them on the lattice.
    for (OctDirection& code : block.code) {
      const auto [sx, sy] = sobol_2d(index++);
      code = encode_octahedral(
          now.sample({uniform_float(owen_scramble(sx, seeds[0])), uniform_float(owen_scramble(sy, seeds[1]))}));
    }

    // Look everything up at the lattice directions, with the look-up that the pixels use.
    kernels::decode_directions(block.code, block.x, block.y, block.z);
    kernels::evaluate_environment(now_view, block.x, block.y, block.z, block.r, block.g, block.b, block.density);
    float unused[LightPool::kBlock];
    kernels::evaluate_environment(before_view, block.x, block.y, block.z, block.before_r, block.before_g, block.before_b,
                                  unused);
  }
  return pool;
}

}  // namespace baton
