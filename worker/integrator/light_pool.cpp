#include "worker/integrator/light_pool.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <numeric>
#include <utility>

#include "common/math/low_discrepancy.h"
#include "worker/integrator/kernels.h"

namespace baton {
namespace {

/// The order in which eight consecutive points of the sequence fill block `index`: random, because
/// the j-th of eight consecutive Sobol' points always lies in the same eighth of the table, and a
/// reader that always takes the j-th entry of random blocks must see all of it.
std::array<std::uint32_t, LightPool::kBlock> shuffled_order(const Rng& rng, std::uint32_t index) {
  std::array<std::uint32_t, LightPool::kBlock> order{};
  std::iota(order.begin(), order.end(), 0u);
  const auto first = rng.bits(1, index);
  const auto second = rng.bits(2, index);
  for (std::uint32_t i = LightPool::kBlock - 1; i > 0; --i) {
    const std::uint32_t bits = i < 4 ? first[i] : second[i - 4];
    std::swap(order[i], order[static_cast<std::size_t>((std::uint64_t{bits} * (i + 1)) >> 32)]);
  }
  return order;
}

/// Turns the directions into the world.
void turn(const Mat3& rotation, LightPool::Block& block) {
  for (std::uint32_t i = 0; i < LightPool::kBlock; ++i) {
    const Vec3 w = rotation * Vec3{block.x[i], block.y[i], block.z[i]};
    block.x[i] = w.x;
    block.y[i] = w.y;
    block.z[i] = w.z;
  }
}

}  // namespace

LightPool make_light_pool(const Environment& now, const Environment& before, std::uint64_t job_seed,
                          std::uint32_t frame, CarriedFrame carried) {
  LightPool pool;
  if (now.map->black()) return pool;
  pool.blocks.resize(LightPool::kSize / LightPool::kBlock);
  const bool turns = carried == CarriedFrame::environment;
  const EnvironmentView now_view = turns ? unturned_view_of(now) : view_of(now);
  const EnvironmentView before_view = turns ? unturned_view_of(before) : view_of(before);
  const Rng rng({.job_seed = job_seed, .frame = frame, .pixel = 0}, PassId::light_pool);
  const Philox4x32::Counter seeds = rng.bits(0, 0);
  for (std::uint32_t index = 0; index < pool.blocks.size(); ++index) {
    LightPool::Block& block = pool.blocks[index];
    const auto order = shuffled_order(rng, index);
    // Draw the directions and put them on the lattice.
    for (std::uint32_t i = 0; i < LightPool::kBlock; ++i) {
      const auto [sx, sy] = sobol_2d(index * LightPool::kBlock + order[i]);
      const Vec3 w = now.map->sample(
          {uniform_float(owen_scramble(sx, seeds[0])), uniform_float(owen_scramble(sy, seeds[1]))});
      block.code[i] = encode_octahedral(turns ? w : now.rotation * w);
    }

    // Look everything up at the lattice directions, with the look-up that the pixels use.
    kernels::decode_directions(block.code, block.x, block.y, block.z);
    kernels::evaluate_environment(now_view, block.x, block.y, block.z, block.r, block.g, block.b,
                                  block.density);
    std::transform(std::begin(block.density), std::end(block.density), block.inverse_density,
                   [](float density) { return density > 0 ? 1 / density : 0.0f; });
    float unused[LightPool::kBlock];
    kernels::evaluate_environment(before_view, block.x, block.y, block.z, block.before_r,
                                  block.before_g, block.before_b, unused);
    if (turns) turn(now.rotation, block);
  }
  return pool;
}

}  // namespace baton
