#include "worker/sampling/visibility_memory.h"

#include <algorithm>
#include <array>

#include "common/base/check.h"

namespace baton {
namespace {

constexpr std::int32_t kShareOfOne = 4095;
constexpr std::int32_t kMaxSeen = 15;

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

  explicit Tally(VisibilityCell cell) : share(cell >> 4), seen(cell & kMaxSeen) {}
  VisibilityCell cell() const { return static_cast<VisibilityCell>(share << 4 | seen); }
  void add(bool free) {
    const std::int32_t outcome = -static_cast<std::int32_t>(free) & kShareOfOne;  // no branch
    share += (outcome - share) * kStep[static_cast<std::size_t>(seen)] >> 16;
    seen = std::min(seen + 1, kMaxSeen);
  }
};

}  // namespace

void remember_rays(PixelMemory& memory, std::span<const std::uint8_t> bin, std::uint64_t free) {
  BATON_CHECK(bin.size() <= 64);
  std::uint32_t outcomes = memory.outcomes;
  Tally all(memory.all_rays);
  if (all.seen == 0) all.share = kShareOfOne / 2;

  // One more ray says nothing new of a pixel that has long been in the open, or in the dark.
  const std::uint64_t every = bin.empty() ? 0 : ~std::uint64_t{0} >> (64 - bin.size());
  if ((outcomes == PixelMemory::kSawFree && free == every) ||
      (outcomes == PixelMemory::kSawBlocked && free == 0)) {
    Tally next = all;
    next.add(free != 0);
    if (next.cell() == all.cell()) return;
  }
  for (std::size_t j = 0; j < bin.size(); ++j) {
    const bool is_free = (free >> j & 1) != 0;
    outcomes |= is_free ? PixelMemory::kSawFree : PixelMemory::kSawBlocked;
    if (outcomes == PixelMemory::kSawBoth) {
      VisibilityCell& cell = memory.bins.cells[bin[j]];
      Tally own(cell);
      if (own.seen == 0) own.share = all.share;
      own.add(is_free);
      cell = own.cell();
    }
    all.add(is_free);
  }
  memory.outcomes = static_cast<std::uint16_t>(outcomes);
  if (!bin.empty()) memory.all_rays = all.cell();
}

}  // namespace baton
