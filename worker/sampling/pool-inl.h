// One frame of the pool sampler (pool.h) for one pixel, in SIMD: candidates are weighed, what the
// pixel remembers of their directions decides which of them get a ray. Free of any scene: all
// about candidates comes from the Candidates. Included once per Highway target.
#if defined(BATON_WORKER_SAMPLING_POOL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SAMPLING_POOL_INL_H_
#undef BATON_WORKER_SAMPLING_POOL_INL_H_
#else
#define BATON_WORKER_SAMPLING_POOL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "worker/sampling/chosen_rays-inl.h"
#include "worker/sampling/light_noise.h"
#include "worker/sampling/pool.h"
#include "worker/sampling/visibility_table.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A lane's bin of BlockMemory. inverse_density: of its direction in the map's table, in sr.
HWY_INLINE VI BinsOf(VU code, VF inverse_density) {
  constexpr int kBits = BlockMemory::kBits;
  constexpr std::uint32_t kMost = BlockMemory::kSide - 1;
  const DU du;
  const DI di;
  const VU across = hn::And(hn::ShiftRight<16 - kBits>(code), hn::Set(du, kMost));
  const VU down = hn::And(hn::ShiftRight<32 - 2 * kBits>(code), hn::Set(du, kMost << kBits));
  const auto is_lamp = hn::Lt(inverse_density, hn::Set(DF(), 1 / kLampDensity));
  const VI of_kind = hn::IfThenElseZero(hn::RebindMask(di, is_lamp),
                                        hn::Set(di, static_cast<std::int32_t>(BlockMemory::kBins)));
  return hn::Or(hn::BitCast(di, hn::Or(across, down)), of_kind);
}

HWY_INLINE VF ContributionFactor(const PoolTuning& tuning, VF expected) {
  return hn::Max(hn::Sqrt(expected), hn::Set(DF(), tuning.least_contribution));
}
HWY_INLINE VF DeviationFactor(const PoolTuning& tuning, VF expected) {
  const DF d;
  const VF variance = hn::Mul(expected, hn::Sub(hn::Set(d, 1.0f), expected));
  return hn::Max(hn::Sqrt(variance), hn::Set(d, tuning.least_deviation));
}

/// What is remembered of a vector of directions: V^, in (0, 1), and the factors on a candidate's
/// weight on the two lines.
struct ProspectLanes {
  VF expected, contribution, deviation;
};

/// V^ of bins, as the rounds before have left it.
class RememberedLanes {
 public:
  RememberedLanes(const PoolTuning& tuning, const PixelVisibility& memory)
      : tuning_(tuning),
        of_block_(memory.of_block.is_uniform ? nullptr : memory.of_block.expected.data()),
        share_(memory.share),
        everywhere_(Prospect(hn::Set(DF(), memory.of_block.everywhere))) {}

  HWY_INLINE ProspectLanes Look(VI bin) const {
    if (of_block_ == nullptr)
      return {everywhere_.expected, everywhere_.contribution, everywhere_.deviation};
    return Prospect(OfPixel(bin, OfBlock(bin)));
  }
  /// V^ as the block has it.
  HWY_INLINE VF OfBlock(VI bin) const {
    return of_block_ == nullptr ? everywhere_.expected : hn::GatherIndex(DF(), of_block_, bin);
  }
  /// V^, where the block has of_block. A block whose rays have always agreed knows its pixels.
  HWY_INLINE VF OfPixel(VI bin, VF of_block) const {
    if (of_block_ == nullptr) return of_block;
    const DF d;
    const auto is_lamp = hn::RebindMask(
        d, hn::Gt(bin, hn::Set(DI(), static_cast<std::int32_t>(BlockMemory::kBins) - 1)));
    const VF share = hn::IfThenElse(is_lamp, hn::Set(d, share_[1]), hn::Set(d, share_[0]));
    return hn::Min(hn::Mul(of_block, share), hn::Set(d, kMostVisible));
  }

 private:
  HWY_INLINE ProspectLanes Prospect(VF expected) const {
    return {expected, ContributionFactor(tuning_, expected), DeviationFactor(tuning_, expected)};
  }
  const PoolTuning& tuning_;
  const float* of_block_;  ///< by bin; null: the same everywhere
  std::array<float, 2> share_;
  ProspectLanes everywhere_;
};

/// Where weighed candidates go: two lines to choose from, and what is known of the pixel by then.
/// A loop that adds works on a copy, in registers.
struct WeighedLines {
  static constexpr bool kHasColors = true;
  const RememberedLanes* memory;
  RunningSums::End contribution, deviation;
  std::int32_t* next_bin;
  /// Where the bins of this kind of candidates begin.
  const std::int32_t* first_bin = next_bin;
  VF light = hn::Zero(DF());                                         ///< sum of w
  Vec3Lanes colors{hn::Zero(DF()), hn::Zero(DF()), hn::Zero(DF())};  ///< sum of w V^ (f cos L) / p~
  VF previous = hn::Zero(DF());                                      ///< w V^ before
  VF last_step = hn::Zero(DF());  ///< difference that led to `previous`
  VF bends = hn::Zero(DF());      ///< sum of squared second differences
  /// `bends` of the candidates from the light, once they are done.
  VF light_bends = hn::Zero(DF());

  /// A vector of candidates. inverse_density: of the map's table. add_color(share, sum) adds share
  /// w (f cos L)_rgb / p~ to `sum`.
  template <class AddColor>
  HWY_INLINE void Add(VU code, VF inverse_density, VF weight, const AddColor& add_color) {
    const DF d;
    const VI bin = BinsOf(code, inverse_density);
    const ProspectLanes prospect = memory->Look(bin);
    hn::Store(bin, DI(), next_bin);
    next_bin += hn::Lanes(d);
    contribution.Add(hn::Mul(weight, prospect.contribution));
    deviation.Add(hn::Mul(weight, prospect.deviation));
    light = hn::Add(light, weight);
    const VF likely = hn::Mul(weight, prospect.expected);
    const auto number = next_bin - first_bin;
    if (number <= 2 * std::ptrdiff_t{hn::MaxLanes(d)}) {  // the first two are too few
      if (number <= std::ptrdiff_t{hn::MaxLanes(d)}) previous = likely;
      last_step = hn::Sub(likely, previous);
    }
    const VF step = hn::Sub(likely, previous);
    const VF bend = hn::Sub(step, last_step);
    bends = hn::MulAdd(bend, bend, bends);
    last_step = step;
    previous = likely;
    add_color(prospect.expected, colors);
  }
  /// Between the candidates from the light and those from the BRDF.
  HWY_INLINE void BeginBsdf() {
    light_bends = bends;
    bends = hn::Zero(DF());
    first_bin = next_bin;
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
  float total;  ///< sum of the line
  bool control;
  std::int32_t count;
  float lns;
};

/// Looks up the rays and what each brings: as a candidate was chosen with probability proportional
/// to w times a factor, w cancels. With the control variate, less what was expected of them.
template <class Chosen>
HWY_INLINE void LookUpRays(const PoolTuning& tuning, const Chosen& chosen, const RayPlan& plan,
                           const DistinctPicks& picks, const RememberedLanes& remembered,
                           const std::int32_t* bin_of, PixelRays& out) {
  const DF d;
  const DI di;
  const VF per_pick = hn::Set(d, plan.total / static_cast<float>(plan.count));
  const VF per_light = hn::Set(d, 1 / plan.lns);
  Vec3Lanes expected{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  VF expected_share = hn::Zero(d);
  for (std::size_t j = 0; j < picks.count; j += hn::Lanes(d)) {
    const VI pick = hn::Load(di, picks.pick.from(j));
    const auto c = chosen.Evaluate(pick);
    const Vec3Lanes w = DecodeOctahedral(c.code);
    const VI bin = hn::GatherIndex(di, bin_of, pick);
    const VF of_block = remembered.OfBlock(bin);
    const VF seen = remembered.OfPixel(bin, of_block);
    const VF light =
        hn::Div(hn::Mul(per_pick, hn::Load(d, picks.times.from(j))),
                plan.control ? DeviationFactor(tuning, seen) : ContributionFactor(tuning, seen));
    const Vec3Lanes color = Scale(c.reflected, hn::Div(light, MeanLanes(c.reflected)));
    const VF share = hn::Mul(light, per_light);
    StoreRays(w, color, share, c.site, j, out);
    const hn::Rebind<std::uint16_t, DI> du16;
    const VI expected_q = hn::ConvertTo(
        di, hn::MulAdd(of_block, hn::Set(d, float{RayTally::kRay}), hn::Set(d, 0.5f)));
    const VI tag = hn::Or(bin, hn::ShiftLeft<RayTag::kBinBits>(expected_q));
    hn::StoreU(hn::DemoteTo(du16, tag), du16, out.tag.from(j));
    const Vec3Lanes sure = Scale(color, seen);
    expected = HWY_NAMESPACE::Add(expected, sure);
    expected_share = hn::MulAdd(share, seen, expected_share);
  }
  out.count = picks.count;
  if (!plan.control) return;
  out.constant.color += SumOfLanes(expected) * -1.0f;
  out.constant.visibility -= hn::GetLane(hn::SumOfLanes(d, expected_share));
}

/// Chooses the rays of a pixel from its candidates by what its memory says of their directions:
/// systematically, u in [0, 1). A candidate that is chosen twice is traced once. candidates: has
/// Weigh(lines), which adds all of them in turn, those of the light first; Chosen(), whose
/// Evaluate(picks) gives `code`, `site` and `reflected` by their number on the line; the numbers
/// from_light and from_bsdf; and mean_radiance, of the environment. memory: as the rounds before
/// left it. num_rays: N, > 0; with a memory a pixel gets N / 2 to 4 N rays, at most kMaxParticles.
/// out: empty. Returns the sum of the weights, an unbiased estimate of Lns; when it is not positive
/// and finite, out stays empty.
template <class Candidates>
HWY_INLINE float PoolStep(const PoolTuning& tuning, const Candidates& candidates, float u,
                          std::int32_t num_rays, const PixelVisibility& memory, PoolLines& scratch,
                          PixelRays& out) {
  const DF d;
  const auto sum = [&](VF v) HWY_ATTR { return hn::GetLane(hn::SumOfLanes(d, v)); };

  // Weigh the candidates.
  RunningSums contribution(scratch.contribution_sums.from(0));
  RunningSums deviation(scratch.deviation_sums.from(0));
  const RememberedLanes remembered(tuning, memory);
  WeighedLines lines{&remembered, contribution.end, deviation.end, scratch.bins.from(0)};
  candidates.Weigh(lines);
  contribution.end = lines.contribution;
  deviation.end = lines.deviation;
  const float lns = sum(lines.light);
  if (!(lns > 0 && std::isfinite(lns))) return lns;

  // Decide how rays count, and how many there are.
  const float total_deviation = deviation.Finish();
  const Rgb visible = SumOfLanes(lines.colors);
  const float expected = mean(visible);
  const bool control = use_control(tuning, expected, total_deviation);
  const float scale = noise_scale(tuning, expected, candidates.mean_radiance);
  const RayPlan plan{control ? deviation : contribution,
                     control ? total_deviation : contribution.Finish(), control,
                     memory.of_block.knows_rays
                         ? rays_for_deviation(tuning, num_rays, total_deviation, scale)
                         : num_rays,
                     lns};
  out.light_variance = {VarianceOfOne(lines.light_bends, candidates.from_light, scale),
                        VarianceOfOne(lines.bends, candidates.from_bsdf, scale)};
  if (control) out.constant = {visible, expected / lns};

  // Choose them.
  const DistinctPicks picks(plan.line, plan.total, u, static_cast<std::size_t>(plan.count));
  LookUpRays(tuning, candidates.Chosen(), plan, picks, remembered, scratch.bins.from(0), out);
  return lns;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
