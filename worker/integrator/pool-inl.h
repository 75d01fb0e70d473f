// The rays of a pixel of the pool sampler in SIMD (sampling/pool.h): candidates are weighed, what
// the pixel remembers of their directions decides which of them get a ray. Included once per
// Highway target.
#if defined(BATON_WORKER_INTEGRATOR_POOL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_INTEGRATOR_POOL_INL_H_
#undef BATON_WORKER_INTEGRATOR_POOL_INL_H_
#else
#define BATON_WORKER_INTEGRATOR_POOL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "worker/integrator/choice-inl.h"
#include "worker/integrator/pool_kernels.h"
#include "worker/sampling/light_noise.h"
#include "worker/sampling/pool.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Bins of a pixel's memory per lane, as visibility_bin().
HWY_INLINE VI VisibilityBins(VU code) {
  static_assert(kVisibilityGridSide == 16);
  const DU du;
  const VU across = hn::And(hn::ShiftRight<12>(code), hn::Set(du, 0x0F));
  const VU down = hn::And(hn::ShiftRight<24>(code), hn::Set(du, 0xF0));
  return hn::BitCast(DI(), hn::Or(across, down));
}

HWY_INLINE VF HopeFactor(VF free) { return hn::Max(hn::Sqrt(free), hn::Set(DF(), kLeastHope)); }
HWY_INLINE VF DoubtFactor(VF free) {
  const DF d;
  const VF variance = hn::Mul(free, hn::Sub(hn::Set(d, 1.0f), free));
  return hn::Max(hn::Sqrt(variance), hn::Set(d, kLeastDoubt));
}

/// What is remembered of a vector of directions: the estimated share of free rays, as free_share(),
/// and what it makes of a candidate's weight on the two lines.
struct ProspectLanes {
  VF free, hope, doubt;
};

/// A pixel's memory.
class RememberedLanes {
 public:
  explicit RememberedLanes(const VisibilityCell* memory)
      : memory_(memory),
        has_bins_(memory[kVisibilityOutcomes] == (kSawFree | kSawBlocked)),
        all_((memory[kVisibilitySummary] & 15) != 0 ? memory[kVisibilitySummary] : 2048 << 4),
        everywhere_(Prospect(Share(hn::Set(DI(), all_)))) {}

  /// A pixel whose rays have always agreed expects the same everywhere.
  HWY_INLINE ProspectLanes Look(VU code) const {
    if (has_bins_) return Prospect(FreeInBins(code));
    return {everywhere_.free, everywhere_.hope, everywhere_.doubt};
  }

 private:
  HWY_INLINE VF FreeInBins(VU code) const {
    const DI di;
    const DU du;
    // Two cells come with each load; ours is the lower one.
    static_assert(sizeof(VisibilityCell) == 2 && kVisibilityCells > kVisibilityBins);
    static_assert(kVisibilityGridSide == 16);
    const VU across = hn::And(hn::ShiftRight<11>(code), hn::Set(du, 2 * 0x0F));
    const VU down = hn::And(hn::ShiftRight<23>(code), hn::Set(du, 2 * 0xF0));
    const VI pair = hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(memory_),
                                     hn::BitCast(di, hn::Or(across, down)));
    const auto unseen = hn::Eq(hn::And(pair, hn::Set(di, 15)), hn::Zero(di));
    return Share(hn::IfThenElse(unseen, hn::Set(di, all_), pair));
  }
  static HWY_INLINE ProspectLanes Prospect(VF free) {
    return {free, HopeFactor(free), DoubtFactor(free)};
  }
  /// Of cells in the lower halves.
  static HWY_INLINE VF Share(VI cells) {
    const DF d;
    const VI share = hn::And(cells, hn::Set(DI(), 0xFFF0));
    return hn::MulAdd(hn::ConvertTo(d, share), hn::Set(d, 1.0f / 65536), hn::Set(d, 0.5f / 4096));
  }
  const VisibilityCell* memory_;
  bool has_bins_;
  std::int32_t all_;
  ProspectLanes everywhere_;
};

/// Where weighed candidates go: two lines to choose from, and what is known of the pixel by then.
/// A loop that adds works on a copy, in registers.
struct PoolLines {
  static constexpr bool kHasColors = true;
  const RememberedLanes* memory;
  RunningSums::End hope, doubt;
  float* next_free;
  const float* first_free = next_free;  ///< where those of this kind of candidates begin
  VF light = hn::Zero(DF());            ///< sum of w
  Vec3Lanes colors{hn::Zero(DF()), hn::Zero(DF()), hn::Zero(DF())};  ///< of w V^ (f cos L) / p~
  VF difference = hn::Zero(DF());                                    ///< even less odd w V^
  VF previous = hn::Zero(DF());                                      ///< w V^ before
  VF last_step = hn::Zero(DF());                                     ///< to it
  VF bends = hn::Zero(DF());        ///< of the squares of its second differences
  VF light_bends = hn::Zero(DF());  ///< those of the candidates from the light, once they are done
  VF sign = hn::Set(DF(), 1.0f);

  template <class AddColor>
  HWY_INLINE void Add(VU code, VF weight, const AddColor& add_color) {
    const DF d;
    const ProspectLanes prospect = memory->Look(code);
    hn::Store(prospect.free, d, next_free);
    next_free += hn::Lanes(d);
    hope.Add(hn::Mul(weight, prospect.hope));
    doubt.Add(hn::Mul(weight, prospect.doubt));
    light = hn::Add(light, weight);
    const VF likely = hn::Mul(weight, prospect.free);
    const auto number = next_free - first_free;
    if (number <= 2 * std::ptrdiff_t{hn::MaxLanes(d)}) {  // the first two are too few
      if (number <= std::ptrdiff_t{hn::MaxLanes(d)}) previous = likely;
      last_step = hn::Sub(likely, previous);
    }
    const VF step = hn::Sub(likely, previous);
    const VF bend = hn::Sub(step, last_step);
    bends = hn::MulAdd(bend, bend, bends);
    last_step = step;
    previous = likely;
    add_color(prospect.free, colors);
    difference = hn::MulAdd(likely, sign, difference);
    sign = hn::Neg(sign);
  }
  HWY_INLINE void BeginBsdf() {
    light_bends = bends;
    bends = hn::Zero(DF());
    first_free = next_free;
  }
};

/// Variance that one of `count` candidates would have, from the squares of their second
/// differences: neighbours along the curve are strata of their own, and what changes evenly from
/// one to the next is no noise.
HWY_INLINE float VarianceOfOne(VF bends, std::int32_t count, float scale) {
  const float sum = hn::GetLane(hn::SumOfLanes(DF(), bends));
  const float variance = sum / 6 / scale / scale * static_cast<float>(count);
  return std::isfinite(variance) ? variance : 0.0f;
}

/// How the rays of a pixel are chosen and counted. Either way is unbiased; which one, candidates
/// and memory say before any ray is chosen.
struct RayPlan {
  const RunningSums& line;
  float total;  ///< of the line
  bool control;
  std::int32_t count;
};

/// Looks up the rays and what each brings: as a candidate was chosen with probability proportional
/// to w times a factor, w cancels. With the control variate, less what was expected of them. Rays
/// are of the even and the odd half in turn.
HWY_INLINE void LookUpRays(const ChosenCandidates& chosen, const RayPlan& plan,
                           const DistinctPicks& picks, const float* free, float lns,
                           PixelRays& out) {
  const DF d;
  const DI di;
  const VF per_pick = hn::Set(d, plan.total / static_cast<float>(plan.count));
  const VF per_light = hn::Set(d, 1 / lns);
  const VF half = AlternateSigns();
  Vec3Lanes expected{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  VF expected_share = hn::Zero(d), difference = hn::Zero(d);
  for (std::size_t j = 0; j < picks.count; j += hn::Lanes(d)) {
    const VI pick = hn::Load(di, picks.pick.from(j));
    const CandidateLanes c = chosen.Evaluate(pick);
    const Vec3Lanes w = DecodeOctahedral(c.code);
    const VF seen = hn::GatherIndex(d, free, pick);
    const VF light = hn::Div(hn::Mul(per_pick, hn::Load(d, picks.times.from(j))),
                             plan.control ? DoubtFactor(seen) : HopeFactor(seen));
    const Vec3Lanes color = Scale(c.reflected, hn::Div(light, MeanLanes(c.reflected)));
    const VF share = hn::Mul(light, per_light);
    StoreRays(w, color, share, c.site, j, out);
    hn::StoreU(hn::DemoteTo(DB(), VisibilityBins(c.code)), DB(), out.bin.from(j));
    const Vec3Lanes sure = Scale(color, seen);
    expected = HWY_NAMESPACE::Add(expected, sure);
    difference = hn::MulAdd(hn::Mul(light, seen), half, difference);
    expected_share = hn::MulAdd(share, seen, expected_share);
  }
  out.count = picks.count;
  if (!plan.control) return;
  out.constant.color += SumOfLanes(expected) * -1.0f;
  out.constant.visibility -= hn::GetLane(hn::SumOfLanes(d, expected_share));
  out.difference -= hn::GetLane(hn::SumOfLanes(d, difference));
}

inline float ChoosePoolRays(const SiteBlock& sites, const EnvironmentView& environment,
                            const LightPool& pool, const kernels::CandidateCounts& counts,
                            const Rng& rng, float u, std::int32_t num_rays,
                            std::span<const VisibilityCell> memory, kernels::PoolScratch& scratch,
                            PixelRays& out) {
  const DF d;
  const auto sum = [&](VF v) HWY_ATTR { return hn::GetLane(hn::SumOfLanes(d, v)); };
  const Philox4x32::Counter random = rng.bits(0, 0);

  // Weigh the candidates.
  RunningSums hope(scratch.hope_sums.from(0)), doubt(scratch.doubt_sums.from(0));
  const RememberedLanes remembered(memory.data());
  PoolLines lines{&remembered, hope.end, doubt.end, scratch.free.from(0)};
  WeighCandidates(sites, environment, pool, counts, random, scratch.from_bsdf, lines);
  hope.end = lines.hope;
  doubt.end = lines.doubt;
  const float lns = sum(lines.light);
  if (!(lns > 0 && std::isfinite(lns))) return lns;

  // Decide what rays are worth.
  const float in_doubt = doubt.Finish();
  const Rgb visible = SumOfLanes(lines.colors);
  const float expected = mean(visible);
  const bool control = use_control(expected, in_doubt);
  const bool knows = memory[kVisibilityOutcomes] != 0;
  const float scale = noise_scale(lns, pool.mean_radiance);
  const RayPlan plan{control ? doubt : hope, control ? in_doubt : hope.Finish(), control,
                     knows ? rays_for_doubt(num_rays, in_doubt, scale) : num_rays};
  out.difference = sum(lines.difference);
  out.light_variance = {VarianceOfOne(lines.light_bends, counts.from_light, scale),
                        VarianceOfOne(lines.bends, counts.from_bsdf, scale)};
  if (control) out.constant = {visible, expected / lns};

  // Choose them.
  const auto picks =
      DistinctPicks::Systematic(plan.line, plan.total, u, static_cast<std::size_t>(plan.count));
  LookUpRays(ChosenCandidates(sites, pool, counts, random, scratch.from_bsdf), plan, picks,
             scratch.free.from(0), lns, out);
  return lns;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
