#include "worker/sampling/restir.h"

#include <algorithm>

#include "common/base/check.h"

namespace baton {

double weigh_restir_sets(std::span<const RestirSet> sets, std::span<const float> contribution,
                         std::span<const float> target_now, std::span<float> weight) {
  BATON_CHECK(!sets.empty() && sets.back().end == weight.size());
  const std::size_t count = weight.size();

  // What all sets together bring to each place.
  std::copy_n(target_now.begin(), count, weight.begin());
  for (const RestirSet& set : sets.subspan(1)) {
    for (std::size_t i = 0; i < count; ++i) weight[i] += set.confidence * set.target_before[i];
  }

  // Each sample's share of it.
  double total = 0;
  std::size_t i = 0;
  for (const RestirSet& set : sets) {
    for (; i < set.end; ++i) {
      const float share = target_now[i] > 0 ? set.confidence * target_now[i] / weight[i] : 0.0f;
      weight[i] = contribution[i] * share;
      total += double{weight[i]};
    }
  }
  return total;
}

void pick_systematically(std::span<const float> weight, double total, float u,
                         std::span<std::uint32_t> picks) {
  // Rounding may leave the last positions past the sum: they belong to the last that weighs.
  std::size_t last = weight.size() - 1;
  while (last > 0 && !(weight[last] > 0)) --last;
  const double stride = total / static_cast<double>(picks.size());
  std::size_t i = 0;
  double passed = double{weight[0]};
  for (std::size_t m = 0; m < picks.size(); ++m) {
    const double position = (static_cast<double>(m) + double{u}) * stride;
    while (passed <= position && i < last) passed += double{weight[++i]};
    picks[m] = static_cast<std::uint32_t>(i);
  }
}

std::uint16_t next_confidence(std::span<const RestirSet> sets, std::int32_t history_limit) {
  float sum = 0;
  for (const RestirSet& set : sets) sum += set.confidence;
  return static_cast<std::uint16_t>(std::min(sum, static_cast<float>(history_limit)));
}

}  // namespace baton
