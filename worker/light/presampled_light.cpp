#include "worker/light/presampled_light.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <numbers>
#include <span>
#include <utility>

#include "common/base/limits.h"
#include "common/math/hilbert.h"
#include "common/math/low_discrepancy.h"
#include "worker/light/candidates.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

/// The directions of a set's entries, in the order of the sequence.
std::vector<OctDirection> draw_directions(const Environment& now, const Philox4x32::Counter& seeds,
                                          std::uint32_t set) {
  // A net has one point in each of as many equal stretches. They are drawn from the top of the map
  // to its bottom: what neighbours read of the table is in the cache.
  constexpr int kShift = 32 - std::countr_zero(PresampledLight::kSize);
  struct Point {
    std::uint32_t number, x, y;
  };
  std::vector<Point> points(PresampledLight::kSize);
  for (std::uint32_t i = 0; i < PresampledLight::kSize; ++i) {
    const auto [x, y] = sobol_2d(set * PresampledLight::kSize + i);
    const std::uint32_t down = owen_scramble(x, seeds[0]);
    points[down >> kShift] = {i, down, owen_scramble(y, seeds[1])};
  }
  std::vector<OctDirection> directions(PresampledLight::kSize);
  for (const auto& [number, x, y] : points) {
    const Vec3 w = now.map->sample({uniform_float(x), uniform_float(y)});
    directions[number] = encode_octahedral(now.rotation * w);
  }
  return directions;
}

/// Sorts directions along the curve.
void sort_along_curve(std::span<OctDirection> directions) {
  std::vector<std::uint64_t> order;  // place, direction
  order.reserve(directions.size());
  for (const OctDirection w : directions)
    order.push_back(std::uint64_t{hilbert_index(w & 0xFFFFu, w >> 16)} << 32 | w);
  std::sort(order.begin(), order.end());
  std::transform(order.begin(), order.end(), directions.begin(),
                 [](std::uint64_t entry) { return static_cast<OctDirection>(entry); });
}

/// Puts a sorted stretch into its blocks; place 0 of them gets the eighth `first` of the curve.
void lay_out(std::span<const OctDirection> sorted, std::uint32_t first,
             std::span<PresampledLight::Block> blocks) {
  for (std::uint32_t place = 0; place < PresampledLight::kBlock; ++place) {
    const std::uint32_t eighth =
        (PresampledLight::kEighthOf[place] + first) % PresampledLight::kBlock;
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      blocks[b].code[place] = sorted[eighth * blocks.size() + b];
    }
  }
}

/// Mean radiance over the sphere, grey.
float mean_radiance(std::span<const PresampledLight::Block> blocks) {
  double sum = 0;
  for (const PresampledLight::Block& block : blocks) {
    for (std::uint32_t i = 0; i < PresampledLight::kBlock; ++i)
      sum += double{block.r[i] + block.g[i] + block.b[i]} * block.inverse_density[i];
  }
  return static_cast<float>(sum / (3 * 4 * std::numbers::pi * PresampledLight::kSize));
}

}  // namespace

PresampledLight presample_light(const Environment& now, const Environment& before,
                                std::uint64_t job_seed, std::uint32_t frame,
                                const PresampledLightLayout& layout, std::int32_t round,
                                std::uint32_t set) {
  PresampledLight presampled;
  if (now.map->black()) return presampled;
  const Rng rng({.job_seed = job_seed,
                 .frame = frame,
                 .pixel = 0,
                 .round = static_cast<std::uint32_t>(round)},
                PassId::presampled_light);

  // Draw the directions, stretch by stretch.
  const EnvironmentView now_view = view_of(now);
  presampled.blocks.resize(PresampledLight::kNumBlocks);
  const std::uint32_t num_blocks =
      (layout.num_taken + PresampledLight::kBlock - 1) / PresampledLight::kBlock;
  presampled.run_blocks =
      layout.one_run ? PresampledLight::kNumBlocks
                     : std::bit_ceil(std::clamp(num_blocks, 1u, PresampledLight::kMaxRunBlocks));
  std::vector<OctDirection> directions = draw_directions(now, rng.bits(0, 0), set);
  for (std::uint32_t first = 0; first < PresampledLight::kNumBlocks;
       first += presampled.run_blocks) {
    const auto run = std::span(directions)
                         .subspan(first * PresampledLight::kBlock,
                                  presampled.run_blocks * PresampledLight::kBlock);
    sort_along_curve(run);
    lay_out(run, first / presampled.run_blocks,
            std::span(presampled.blocks).subspan(first, presampled.run_blocks));
  }

  // Look everything up at the lattice directions, with the lookup that the pixels use.
  const EnvironmentView before_view = view_of(before);
  if (layout.with_before) presampled.before.resize(presampled.blocks.size());
  for (std::size_t b = 0; b < presampled.blocks.size(); ++b) {
    PresampledLight::Block& block = presampled.blocks[b];
    kernels::decode_directions(block.code, block.x, block.y, block.z);
    kernels::evaluate_environment(now_view, block.x, block.y, block.z, block.r, block.g, block.b,
                                  block.density);
    std::transform(std::begin(block.density), std::end(block.density), block.inverse_density,
                   [](float density) { return density > 0 ? 1 / density : 0.0f; });
    if (presampled.before.empty()) continue;
    PresampledLight::Before& old = presampled.before[b];
    float unused[PresampledLight::kBlock];
    kernels::evaluate_environment(before_view, block.x, block.y, block.z, old.r, old.g, old.b,
                                  unused);
  }
  presampled.mean_radiance = mean_radiance(presampled.blocks);
  return presampled;
}

PresampledSets presample_sets(const Environment& now, const Environment& before,
                              std::uint64_t job_seed, std::uint32_t frame,
                              const PresampledLightLayout& layout, std::int32_t round,
                              std::int32_t num_sets, const DoParts& do_parts) {
  PresampledSets result;
  result.sets.resize(static_cast<std::size_t>(num_sets));
  do_parts(result.sets.size(), [&](std::size_t set) {
    result.sets[set] = presample_light(now, before, job_seed, frame, layout, round,
                                       static_cast<std::uint32_t>(set));
  });
  return result;
}

std::int32_t num_presampled_sets(std::int64_t num_pixels, std::int32_t rounds) {
  const auto most = static_cast<std::uint32_t>(std::max(kMostSetsOfFrame / rounds, 1));
  const auto wanted = static_cast<std::uint64_t>((num_pixels + kPixelsOfSet - 1) / kPixelsOfSet);
  return static_cast<std::int32_t>(
      std::min<std::uint64_t>(std::bit_ceil(wanted), std::bit_floor(most)));
}

const PresampledLight& PresampledSets::of(std::int32_t x, std::int32_t y) const {
  if (sets.size() == 1) return sets.front();
  // Overscan has negative places.
  const auto across = static_cast<std::uint32_t>((x + limits::kMaxOverscan) / kSquare);
  const auto down = static_cast<std::uint32_t>((y + limits::kMaxOverscan) / kSquare);
  const int bits = std::countr_zero(sets.size());
  const std::uint32_t columns = 1u << (bits + 1) / 2, rows = 1u << bits / 2;
  const std::uint32_t number = across % columns + columns * (down % rows);
  const std::uint32_t turn =
      owen_scramble(across / columns * 0x9E3779B9u + down / rows, 0x5BD1E995u);
  return sets[(number ^ turn) % sets.size()];
}

}  // namespace baton
