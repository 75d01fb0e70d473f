#include "worker/method/ratio/ratio_kernels.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/method/ratio/ratio_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/light/choice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// The line of weights, and what all candidates reflect together.
struct ColorLine {
  RunningSums::End end;
  static constexpr bool kHasColors = true;
  Vec3Lanes colors{hn::Zero(DF()), hn::Zero(DF()), hn::Zero(DF())};  ///< sum of w (f cos L) / p~

  template <class AddColor>
  HWY_INLINE void Add(VU /*code*/, VF /*inverse_density*/, VF weight, const AddColor& add_color) {
    end.Add(weight);
    add_color(hn::Set(DF(), 1.0f), colors);
  }
  void BeginBsdf() {}
};

/// Looks up the rays and what each brings. reflected: of all candidates. total: of the line, in
/// units of which colours are added: they may be as dim as numbers get.
HWY_INLINE void LookUpShares(const ChosenCandidates& chosen, const DistinctPicks& picks,
                             const Vec3Lanes& reflected, float total, float num_rays,
                             PixelRays& out) {
  const DF d;
  const VF per_pick = hn::Set(d, total / num_rays);
  Vec3Lanes sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  for (std::size_t j = 0; j < picks.count; j += hn::Lanes(d)) {
    const CandidateLanes c = chosen.Evaluate(hn::Load(DI(), picks.pick.from(j)));
    const Vec3Lanes w = DecodeOctahedral(c.code);
    const VF times = hn::Load(d, picks.times.from(j));
    const VF light = hn::Mul(per_pick, times);
    const Vec3Lanes color = Scale(c.reflected, hn::Div(light, MeanLanes(c.reflected)));
    sum = HWY_NAMESPACE::Add(sum, color);
    StoreRays(w, color, hn::Div(times, hn::Set(d, num_rays)), c.site, j, out);
  }
  out.count = picks.count;
  std::fill_n(out.tag.from(0), picks.count, std::uint16_t{0});

  // Scale them to what all candidates reflect, channel by channel.
  const auto scale = [&](VF all, VF chosen_ones, PixelRays::Column<float>& column) HWY_ATTR {
    const float a = hn::GetLane(hn::SumOfLanes(d, all));
    const float b = hn::GetLane(hn::SumOfLanes(d, chosen_ones));
    const float factor = b > 0 ? a / b : 0.0f;
    for (std::size_t j = 0; j < picks.count; ++j) column[j] *= factor;
  };
  scale(reflected.x, sum.x, out.r);
  scale(reflected.y, sum.y, out.g);
  scale(reflected.z, sum.z, out.b);
}

inline float ChooseRatioRays(const kernels::CandidateSource& from, float u, std::int32_t num_rays,
                             kernels::ChoiceScratch& scratch, PixelRays& out) {
  // Weigh the candidates.
  RunningSums sums(scratch.running_sums.from(0));
  ColorLine line{sums.end};
  WeighCandidates(from, scratch.from_bsdf, line);
  sums.end = line.end;
  const float total = sums.Finish();
  if (!(total > 0 && std::isfinite(total))) return total;

  // Choose the rays.
  const auto count = static_cast<std::size_t>(num_rays);
  LookUpShares(ChosenCandidates(from, scratch.from_bsdf), DistinctPicks(sums, total, u, count),
               line.colors, total, static_cast<float>(num_rays), out);
  return total;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(ChooseRatioRays);

namespace kernels {

float choose_ratio_rays(const CandidateSource& from, float u, std::int32_t num_rays,
                        ChoiceScratch& scratch, PixelRays& out) {
  check_source(from);
  BATON_CHECK(num_rays >= 1 && num_rays <= static_cast<std::int32_t>(limits::kMaxParticles));
  out.clear();
  if (from.presampled.empty()) return 0;
  return HWY_DYNAMIC_DISPATCH(ChooseRatioRays)(from, u, num_rays, scratch, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
