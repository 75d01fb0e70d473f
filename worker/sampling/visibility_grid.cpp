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

/// A cell, taken apart.
struct Tally {
  std::int32_t share, seen;

  explicit Tally(VisibilityCell cell) : share(baton::share(cell)), seen(baton::seen(cell)) {}
  VisibilityCell cell() const { return static_cast<VisibilityCell>(share << 4 | seen); }
  void add(bool free) {
    const std::int32_t outcome = -static_cast<std::int32_t>(free) & kShareOfOne;  // no branch
    share += (outcome - share) * kStep[static_cast<std::size_t>(seen)] >> 16;
    seen = std::min(seen + 1, kMaxSeen);
  }
};

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
  std::uint32_t outcomes = grid[kVisibilityOutcomes];
  Tally all(grid[kVisibilitySummary]);
  if (all.seen == 0) all.share = kShareOfOne / 2;

  // Of a pixel that has long been in the open, or in the dark, one more ray says nothing new.
  const std::uint64_t every = bin.empty() ? 0 : ~std::uint64_t{0} >> (64 - bin.size());
  if ((outcomes == kSawFree && free == every) || (outcomes == kSawBlocked && free == 0)) {
    Tally next = all;
    next.add(free != 0);
    if (next.cell() == all.cell()) return;
  }
  for (std::size_t j = 0; j < bin.size(); ++j) {
    const bool is_free = (free >> j & 1) != 0;
    outcomes |= is_free ? kSawFree : kSawBlocked;
    if (outcomes == (kSawFree | kSawBlocked)) {
      Tally own(grid[bin[j]]);
      if (own.seen == 0) own.share = all.share;  // a guess, worth one ray
      own.add(is_free);
      grid[bin[j]] = own.cell();
    }
    all.add(is_free);
  }
  grid[kVisibilityOutcomes] = static_cast<VisibilityCell>(outcomes);
  if (!bin.empty()) grid[kVisibilitySummary] = all.cell();
}

}  // namespace baton
