#include "worker/integrator/light_pool.h"

#include "common/math/low_discrepancy.h"
#include "worker/integrator/kernels.h"

namespace baton {

LightPool make_light_pool(const Environment& now, const Environment& before, std::uint64_t job_seed,
                          std::uint32_t frame) {
  LightPool pool;
  if (now.map->black()) return pool;
  constexpr std::size_t kSize = LightPool::kSize;
  for (auto* array : {&pool.x, &pool.y, &pool.z, &pool.r, &pool.g, &pool.b, &pool.density, &pool.before_r,
                      &pool.before_g, &pool.before_b}) {
    array->resize(kSize);
  }
  pool.code.resize(kSize);

  // Draw the directions and put them on the lattice.
  const Rng rng({.job_seed = job_seed, .frame = frame, .pixel = 0}, PassId::light_pool);
  const Philox4x32::Counter seeds = rng.bits(0, 0);
  for (std::size_t i = 0; i < kSize; ++i) {
    const auto [sx, sy] = sobol_2d(static_cast<std::uint32_t>(i));
    const Vec3 w = now.sample({uniform_float(owen_scramble(sx, seeds[0])), uniform_float(owen_scramble(sy, seeds[1]))});
    pool.code[i] = encode_octahedral(w);
  }

  // Look everything up at the lattice directions, with the look-up that the pixels use.
  kernels::decode_directions(pool.code, pool.x, pool.y, pool.z);
  kernels::evaluate_environment(view_of(now), pool.x, pool.y, pool.z, pool.r, pool.g, pool.b, pool.density);
  std::vector<float> unused(kSize);
  kernels::evaluate_environment(view_of(before), pool.x, pool.y, pool.z, pool.before_r, pool.before_g, pool.before_b,
                                unused);
  return pool;
}

}  // namespace baton
