#include "worker/sampling/systematic_choice.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/limits.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/sampling/systematic_choice.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/math/lanes-inl.h"

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
  const DF d;
  const DI di;
  constexpr std::size_t kLanes = hn::MaxLanes(DF());
  const auto num_chosen = static_cast<std::int32_t>(chosen.size());

  // Where each lane's stretch of the line begins.
  VF sum = hn::Zero(d);
  for (std::size_t i = 0; i < weights.size(); i += kLanes)
    sum = hn::Add(sum, LoadWeights(weights, i));
  HWY_ALIGN float start[kLanes];
  hn::Store(sum, d, start);
  float total = 0;
  for (float& s : start) {
    const float lane = s;
    s = total;
    total += lane;
  }

  // Walk: `before` of the positions (m + u) total / K lie before a weight's stretch, `after` before
  // its end. Sums of floats and all that follows are monotonic, so stretches neither overlap nor
  // leave gaps, and a weight of zero has none. Who holds a position notes it at the first one.
  const VF stretch_start = hn::Load(d, start);
  const VF inverse = hn::Set(d, static_cast<float>(num_chosen) / total);
  const VI last = hn::Set(di, num_chosen);
  const auto positions_before = [&](VF at) HWY_ATTR {
    return hn::Min(hn::ConvertTo(di, hn::Ceil(hn::MulSub(at, inverse, hn::Set(d, u)))), last);
  };
  std::int32_t first_of[limits::kMaxParticles + 1];
  std::fill_n(first_of, num_chosen, -1);
  VF walked = hn::Zero(d);
  VI before = positions_before(stretch_start);
  for (std::size_t i = 0; i < weights.size(); i += kLanes) {
    walked = hn::Add(walked, LoadWeights(weights, i));
    const VI after = positions_before(hn::Add(stretch_start, walked));
    HWY_ALIGN std::int32_t slot[kLanes];
    hn::Store(hn::IfThenElse(hn::Gt(after, before), before, last), di, slot);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      first_of[slot[lane]] = static_cast<std::int32_t>(i + lane);
    }
    before = after;
  }

  // The holder of a position holds those up to the next note.
  std::int32_t holder = -1;
  for (std::size_t m = 0; m < chosen.size(); ++m) {
    holder = first_of[m] >= 0 ? first_of[m] : holder;
    chosen[m] = holder;
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(SystematicChoice);

void systematic_choice(std::span<const float> weights, float u, std::span<std::int32_t> chosen) {
  BATON_CHECK(!weights.empty() && !chosen.empty() && chosen.size() <= limits::kMaxParticles);
  HWY_DYNAMIC_DISPATCH(SystematicChoice)(weights, u, chosen);
  BATON_CHECK(chosen[0] >= 0);
}

}  // namespace baton
#endif  // HWY_ONCE
