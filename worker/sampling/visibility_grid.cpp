#include "worker/sampling/visibility_grid.h"

#include <algorithm>
#include <array>

#include "common/base/check.h"

namespace baton {
namespace {

constexpr std::int32_t kShareOfOne = 4095;
constexpr std::int32_t kMaxSeen = 15;

std::int32_t seen(VisibilityCell cell) { return cell & 15; }
std::int32_t share(VisibilityCell cell) { return cell >> 4; }

/// 2^16 over the rays that a cell has seen, its guess and the new one: a table, as divisions by a
/// variable cost more than all else here.
constexpr auto kStep = [] {
  std::array<std::int32_t, kMaxSeen + 1> step{};
  for (std::int32_t n = 0; n <= kMaxSeen; ++n)
    step[static_cast<std::size_t>(n)] = (1 << 16) / (n + 2);
  return step;
}();

/// The cell after one more ray; `guess` is what it starts from, worth one ray.
VisibilityCell add_ray(VisibilityCell cell, std::int32_t guess, bool free) {
  const std::int32_t before = seen(cell) > 0 ? share(cell) : guess;
  const std::int32_t step = kStep[static_cast<std::size_t>(seen(cell))];
  const std::int32_t after = before + (((free ? kShareOfOne : 0) - before) * step >> 16);
  return static_cast<VisibilityCell>(after << 4 | std::min(seen(cell) + 1, kMaxSeen));
}

}  // namespace

float free_share(std::span<const VisibilityCell> grid, std::size_t bin) {
  BATON_CHECK(grid.size() == kVisibilityCells && bin < kVisibilityBins);
  const VisibilityCell cell = seen(grid[bin]) > 0 ? grid[bin] : grid[kVisibilitySummary];
  if (seen(cell) == 0) return 0.5f;
  return (static_cast<float>(share(cell)) + 0.5f) * (1.0f / (kShareOfOne + 1));
}

void remember_rays(std::span<VisibilityCell> grid, std::span<const std::uint8_t> bin,
                   std::uint64_t free) {
  BATON_CHECK(grid.size() == kVisibilityCells && bin.size() <= 64);
  VisibilityCell outcomes = grid[kVisibilityOutcomes];
  VisibilityCell summary = grid[kVisibilitySummary];
  for (std::size_t j = 0; j < bin.size(); ++j) {
    const bool is_free = (free >> j & 1) != 0;
    outcomes = static_cast<VisibilityCell>(outcomes | (is_free ? kSawFree : kSawBlocked));
    const std::int32_t guess = seen(summary) > 0 ? share(summary) : kShareOfOne / 2;
    if (outcomes == (kSawFree | kSawBlocked)) {
      grid[bin[j]] = add_ray(grid[bin[j]], guess, is_free);
    }
    summary = add_ray(summary, guess, is_free);
  }
  grid[kVisibilityOutcomes] = outcomes;
  grid[kVisibilitySummary] = summary;
}

}  // namespace baton
