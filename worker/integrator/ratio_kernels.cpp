#include "worker/integrator/ratio_kernels.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/integrator/ratio_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/integrator/choice-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// The line of weights, and what all candidates reflect together.
struct ColorLine {
  RunningSums::End end;
  Vec3Lanes reflected{hn::Zero(DF()), hn::Zero(DF()), hn::Zero(DF())};  ///< of w (f cos L) / p~

  template <class Color>
  HWY_INLINE void Add(VU /*code*/, VF weight, const Color& color) {
    end.Add(weight);
    reflected = HWY_NAMESPACE::Add(reflected, color());
  }
};

/// Colours of the chosen candidates, lane after lane.
struct ChosenColors {
  static constexpr std::size_t kCapacity = limits::kMaxParticles + hn::MaxLanes(DF());
  HWY_ALIGN float x[kCapacity], y[kCapacity], z[kCapacity];
  HWY_ALIGN float r[kCapacity], g[kCapacity], b[kCapacity];  ///< (f cos L) / p~
  HWY_ALIGN std::int32_t site[kCapacity];
};

HWY_INLINE void LookUpColors(const ChosenCandidates& chosen, const std::int32_t* picks,
                             std::size_t count, ChosenColors& out) {
  const DF d;
  for (std::size_t j = 0; j < count; j += hn::Lanes(d)) {
    const CandidateLanes c = chosen.Evaluate(hn::Load(DI(), picks + j));
    const Vec3Lanes w = DecodeOctahedral(c.code);
    const Vec3Lanes color = Scale(c.reflected, hn::Div(hn::Set(d, 1.0f), MeanLanes(c.reflected)));
    hn::Store(w.x, d, out.x + j);
    hn::Store(w.y, d, out.y + j);
    hn::Store(w.z, d, out.z + j);
    hn::Store(color.x, d, out.r + j);
    hn::Store(color.y, d, out.g + j);
    hn::Store(color.z, d, out.b + j);
    hn::Store(c.site, DI(), out.site + j);
  }
}

/// Hands out the rays, each once. reflected: of all candidates.
inline void PushShares(const std::int32_t* picks, std::size_t count, const ChosenColors& chosen,
                       const Rgb& reflected, PixelRays& out) {
  Rgb sum;
  for (std::size_t j = 0; j < count; ++j) sum += Rgb{chosen.r[j], chosen.g[j], chosen.b[j]};
  const auto over = [](float a, float b) { return b > 0 ? a / b : 0.0f; };
  const Rgb scale{over(reflected.x, sum.x), over(reflected.y, sum.y), over(reflected.z, sum.z)};
  for (std::size_t j = 0; j < count;) {
    const std::size_t first = j;
    while (j < count && picks[j] == picks[first]) ++j;
    const auto times = static_cast<float>(j - first);
    const Rgb color = Rgb{chosen.r[first], chosen.g[first], chosen.b[first]} * scale * times;
    out.push({chosen.x[first], chosen.y[first], chosen.z[first]},
             static_cast<std::uint8_t>(chosen.site[first]), 0,
             {color, times / static_cast<float>(count)});
  }
}

inline float ChooseRatioRays(const SiteBlock& sites, const EnvironmentView& environment,
                             const LightPool& pool, const kernels::CandidateCounts& counts,
                             const Rng& rng, float u, std::int32_t num_rays,
                             kernels::ChoiceScratch& scratch, PixelRays& out) {
  const DF d;
  const Philox4x32::Counter random = rng.bits(0, 0);

  // Weigh the candidates.
  RunningSums sums(scratch.running_sums);
  ColorLine line{sums.end};
  WeighCandidates(sites, environment, pool, counts, random, scratch.from_bsdf, line);
  sums.end = line.end;
  const float total = sums.Finish();
  if (!(total > 0 && std::isfinite(total))) return total;

  // Choose the rays.
  const auto count = static_cast<std::size_t>(num_rays);
  HWY_ALIGN std::int32_t picks[limits::kMaxParticles + RunningSums::kGroup];
  SystematicPicks(sums, total, u, count, picks);
  ChosenColors chosen;
  LookUpColors(ChosenCandidates(sites, pool, counts, random, scratch.from_bsdf), picks, count,
               chosen);
  const auto sum = [&](VF v) HWY_ATTR { return hn::GetLane(hn::SumOfLanes(d, v)); };
  PushShares(picks, count, chosen,
             {sum(line.reflected.x), sum(line.reflected.y), sum(line.reflected.z)}, out);
  return total;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(ChooseRatioRays);

namespace kernels {

float choose_ratio_rays(const SiteBlock& sites, const EnvironmentView& environment,
                        const LightPool& pool, const CandidateCounts& counts, const Rng& rng,
                        float u, std::int32_t num_rays, ChoiceScratch& scratch, PixelRays& out) {
  check_counts(sites, counts);
  BATON_CHECK(num_rays >= 1 && num_rays <= static_cast<std::int32_t>(limits::kMaxParticles));
  out.clear();
  if (pool.empty()) return 0;
  return HWY_DYNAMIC_DISPATCH(ChooseRatioRays)(sites, environment, pool, counts, rng, u, num_rays,
                                               scratch, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
