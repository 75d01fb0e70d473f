#include "worker/sampling/visibility_grid.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace baton {
namespace {

constexpr std::int32_t kShareOfOne = 4095;
constexpr std::int32_t kMaxSeen = 15;

std::int32_t seen(VisibilityCell cell) { return cell & 15; }
std::int32_t share(VisibilityCell cell) { return cell >> 4; }

/// The cell after one more ray; `guess` is what it starts from, worth one ray.
VisibilityCell add_ray(VisibilityCell cell, std::int32_t guess, bool free) {
  const std::int32_t before = seen(cell) > 0 ? share(cell) : guess;
  const std::int32_t after = before + ((free ? kShareOfOne : 0) - before) / (seen(cell) + 2);
  return static_cast<VisibilityCell>(after << 4 | std::min(seen(cell) + 1, kMaxSeen));
}

}  // namespace

std::size_t visibility_bin(const Vec3& w) {
  const float inv = 1.0f / (std::fabs(w.x) + std::fabs(w.y) + std::fabs(w.z));
  float u = w.x * inv;
  float v = w.z * inv;
  if (w.y < 0) {
    const float fold_u = std::copysign(1.0f - std::fabs(v), u);
    const float fold_v = std::copysign(1.0f - std::fabs(u), v);
    u = fold_u;
    v = fold_v;
  }
  const auto cell = [](float t) {
    const auto index =
        static_cast<std::int32_t>((t * 0.5f + 0.5f) * static_cast<float>(kVisibilityGridSide));
    return std::clamp(index, 0, kVisibilityGridSide - 1);
  };
  return static_cast<std::size_t>(cell(v) * kVisibilityGridSide + cell(u));
}

float free_share(std::span<const VisibilityCell> grid, std::size_t bin) {
  BATON_CHECK(grid.size() == kVisibilityCells && bin < kVisibilityBins);
  const VisibilityCell cell = seen(grid[bin]) > 0 ? grid[bin] : grid[kVisibilitySummary];
  if (seen(cell) == 0) return 0.5f;
  return (static_cast<float>(share(cell)) + 0.5f) * (1.0f / (kShareOfOne + 1));
}

void remember_ray(std::span<VisibilityCell> grid, const Vec3& direction, bool free) {
  BATON_CHECK(grid.size() == kVisibilityCells);
  VisibilityCell& outcomes = grid[kVisibilityOutcomes];
  VisibilityCell& summary = grid[kVisibilitySummary];
  outcomes = static_cast<VisibilityCell>(outcomes | (free ? kSawFree : kSawBlocked));
  const std::int32_t guess = seen(summary) > 0 ? share(summary) : kShareOfOne / 2;
  if (outcomes == (kSawFree | kSawBlocked)) {
    VisibilityCell& bin = grid[visibility_bin(direction)];
    bin = add_ray(bin, guess, free);
  }
  summary = add_ray(summary, guess, free);
}

}  // namespace baton
