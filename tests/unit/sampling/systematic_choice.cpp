#include "tests/unit/sampling/systematic_choice.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/limits.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/unit/sampling/systematic_choice.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/sampling/systematic-inl.h"

#ifndef BATON_TESTS_UNIT_SAMPLING_SYSTEMATIC_CHOICE_ONCE
#define BATON_TESTS_UNIT_SAMPLING_SYSTEMATIC_CHOICE_ONCE
namespace baton {
/// Room for the candidates of a pixel, padded.
inline constexpr std::size_t kMaxWeights = limits::kMaxCandidates + limits::kMaxParticles + 64;
}  // namespace baton
#endif

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// weights[i], weights[i + 1], ..., zero past the end.
HWY_INLINE VF LoadWeights(std::span<const float> weights, std::size_t i) {
  const DF d;
  const std::size_t left = weights.size() - i;
  if (left >= hn::Lanes(d)) return hn::LoadU(d, weights.data() + i);
  HWY_ALIGN float in[hn::MaxLanes(DF())] = {};
  std::copy_n(weights.data() + i, left, in);
  return hn::Load(d, in);
}

void SystematicChoice(std::span<const float> weights, float u, std::span<std::int32_t> chosen) {
  constexpr std::size_t kLanes = hn::MaxLanes(DF());
  HWY_ALIGN float storage[kMaxWeights + kLanes];
  RunningSums sums(storage);
  for (std::size_t i = 0; i < weights.size(); i += kLanes) sums.end.Add(LoadWeights(weights, i));
  const float total = sums.Finish();
  PaddedArray<std::int32_t, limits::kMaxParticles> picks;
  SystematicPicks(sums, total, u, chosen.size(), picks);
  std::copy_n(picks.from(0), chosen.size(), chosen.data());
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(SystematicChoice);

void systematic_choice(std::span<const float> weights, float u, std::span<std::int32_t> chosen) {
  BATON_CHECK(!weights.empty() && weights.size() <= kMaxWeights && !chosen.empty() &&
              chosen.size() <= limits::kMaxParticles);
  HWY_DYNAMIC_DISPATCH(SystematicChoice)(weights, u, chosen);
}

}  // namespace baton
#endif  // HWY_ONCE
