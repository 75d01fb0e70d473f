#include "worker/integrator/light_pool.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <numbers>
#include <span>
#include <utility>

#include "common/math/hilbert.h"
#include "common/math/low_discrepancy.h"
#include "worker/integrator/kernels.h"

namespace baton {
namespace {

/// The directions of all entries, in the order of the sequence.
std::vector<OctDirection> draw_directions(const Environment& now,
                                          const Philox4x32::Counter& seeds) {
  std::vector<OctDirection> directions(LightPool::kSize);
  for (std::uint32_t i = 0; i < LightPool::kSize; ++i) {
    const auto [sx, sy] = sobol_2d(i);
    const Vec3 w = now.map->sample(
        {uniform_float(owen_scramble(sx, seeds[0])), uniform_float(owen_scramble(sy, seeds[1]))});
    directions[i] = encode_octahedral(now.rotation * w);
  }
  return directions;
}

/// Sorts directions along the curve.
void sort_along_curve(std::span<OctDirection> directions) {
  std::vector<std::pair<std::uint32_t, OctDirection>> order;
  order.reserve(directions.size());
  for (const OctDirection w : directions)
    order.emplace_back(hilbert_index(w & 0xFFFFu, w >> 16), w);
  std::sort(order.begin(), order.end());
  std::transform(order.begin(), order.end(), directions.begin(),
                 [](const auto& entry) { return entry.second; });
}

/// Puts a sorted run into its blocks; place 0 of them gets the eighth `first` of the curve.
void lay_out(std::span<const OctDirection> sorted, std::uint32_t first,
             std::span<LightPool::Block> blocks) {
  for (std::uint32_t place = 0; place < LightPool::kBlock; ++place) {
    const std::uint32_t eighth = (LightPool::kEighthOf[place] + first) % LightPool::kBlock;
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      blocks[b].code[place] = sorted[eighth * blocks.size() + b];
    }
  }
}

/// Mean radiance over the sphere, grey.
float mean_radiance(std::span<const LightPool::Block> blocks) {
  double sum = 0;
  for (const LightPool::Block& block : blocks) {
    for (std::uint32_t i = 0; i < LightPool::kBlock; ++i)
      sum += double{block.r[i] + block.g[i] + block.b[i]} * block.inverse_density[i];
  }
  return static_cast<float>(sum / (3 * 4 * std::numbers::pi * LightPool::kSize));
}

}  // namespace

LightPool make_light_pool(const Environment& now, const Environment& before, std::uint64_t job_seed,
                          std::uint32_t frame, const LightPoolLayout& layout) {
  LightPool pool;
  if (now.map->black()) return pool;
  const Rng rng({.job_seed = job_seed, .frame = frame, .pixel = 0}, PassId::light_pool);

  // Draw the directions, run by run.
  const EnvironmentView now_view = view_of(now);
  pool.blocks.resize(LightPool::kNumBlocks);
  const std::uint32_t num_blocks = (layout.num_taken + LightPool::kBlock - 1) / LightPool::kBlock;
  pool.run_blocks = layout.one_run
                        ? LightPool::kNumBlocks
                        : std::bit_ceil(std::clamp(num_blocks, 1u, LightPool::kMaxRunBlocks));
  std::vector<OctDirection> directions = draw_directions(now, rng.bits(0, 0));
  for (std::uint32_t first = 0; first < LightPool::kNumBlocks; first += pool.run_blocks) {
    const auto run = std::span(directions)
                         .subspan(first * LightPool::kBlock, pool.run_blocks * LightPool::kBlock);
    sort_along_curve(run);
    lay_out(run, first / pool.run_blocks, std::span(pool.blocks).subspan(first, pool.run_blocks));
  }

  // Look everything up at the lattice directions, with the look-up that the pixels use.
  const EnvironmentView before_view = view_of(before);
  pool.has_before = layout.with_before;
  for (LightPool::Block& block : pool.blocks) {
    kernels::decode_directions(block.code, block.x, block.y, block.z);
    kernels::evaluate_environment(now_view, block.x, block.y, block.z, block.r, block.g, block.b,
                                  block.density);
    std::transform(std::begin(block.density), std::end(block.density), block.inverse_density,
                   [](float density) { return density > 0 ? 1 / density : 0.0f; });
    if (!pool.has_before) continue;
    float unused[LightPool::kBlock];
    kernels::evaluate_environment(before_view, block.x, block.y, block.z, block.before_r,
                                  block.before_g, block.before_b, unused);
  }
  pool.mean_radiance = mean_radiance(pool.blocks);
  return pool;
}

}  // namespace baton
