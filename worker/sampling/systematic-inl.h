// Systematic choice from running sums in SIMD. Included once per Highway target.
#if defined(BATON_WORKER_SAMPLING_SYSTEMATIC_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SAMPLING_SYSTEMATIC_INL_H_
#undef BATON_WORKER_SAMPLING_SYSTEMATIC_INL_H_
#else
#define BATON_WORKER_SAMPLING_SYSTEMATIC_INL_H_
#endif

#include <hwy/highway.h>

#include <bit>

#include "common/math/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Weights on a line, lane by lane: first those at 0, 8, 16, ..., then those at 1, 9, ... Eight
/// stretches grow at once, and what is stored are their lengths so far, which never fall.
class RunningSums {
 public:
  /// storage: room for all vectors, aligned.
  explicit RunningSums(float* storage) : storage_(storage), walked_(hn::Zero(DF())) {}

  /// Appends a vector of non-negative weights.
  HWY_INLINE void Add(VF weight) {
    const DF d;
    walked_ = hn::Add(walked_, weight);
    hn::Store(walked_, d, storage_ + size_);
    size_ += hn::Lanes(d);
  }

  /// Ends the line: fixes where each lane's stretch ends and returns the sum of all weights.
  HWY_INLINE float Finish() {
    hn::Store(walked_, DF(), length_);
    float total = 0;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      start_[lane] = total;
      total += length_[lane];
      end_[lane] = total;
      if (length_[lane] > 0) last_ = static_cast<std::int32_t>(lane);
    }
    return total;
  }

  /// After Finish: the weights that hold positions, each in [0, total], total > 0; never one of
  /// weight 0.
  HWY_INLINE VI Find(VF position) const {
    const DF d;
    const DI di;
    // The lane is the first whose stretch ends later; rounding past the end counts to the last.
    VI lane = hn::Zero(di);
    for (std::size_t k = 0; k + 1 < kLanes; ++k) {
      const auto passed = hn::Le(hn::Set(d, end_[k]), position);
      lane = hn::Add(lane, hn::IfThenElseZero(hn::RebindMask(di, passed), hn::Set(di, 1)));
    }
    lane = hn::Min(lane, hn::Set(di, last_));
    const VF longest = hn::Mul(hn::GatherIndex(d, length_, lane), hn::Set(d, 1 - 0x1p-23f));
    const VF along = hn::Min(hn::Sub(position, hn::GatherIndex(d, start_, lane)), longest);

    // Within it, the first sum that exceeds the position.
    const auto vectors = static_cast<std::uint32_t>(size_ / kLanes);
    VI found = hn::Zero(di);
    for (std::uint32_t step = std::bit_floor(vectors); step > 0; step /= 2) {
      const VI next = hn::Add(found, hn::Set(di, static_cast<std::int32_t>(step)));
      const VI probe = hn::Min(hn::Sub(next, hn::Set(di, 1)),
                               hn::Set(di, static_cast<std::int32_t>(vectors) - 1));
      const VI at = hn::Add(hn::Mul(probe, hn::Set(di, static_cast<std::int32_t>(kLanes))), lane);
      const auto passed = hn::Le(hn::GatherIndex(d, storage_, at), along);
      found = hn::IfThenElse(hn::RebindMask(di, passed), next, found);
    }
    found = hn::Min(found, hn::Set(di, static_cast<std::int32_t>(vectors) - 1));
    return hn::Add(hn::Mul(found, hn::Set(di, static_cast<std::int32_t>(kLanes))), lane);
  }

 private:
  static constexpr std::size_t kLanes = hn::MaxLanes(DF());
  float* storage_;
  std::size_t size_ = 0;
  VF walked_;
  std::int32_t last_ = 0;  ///< last lane with a length
  HWY_ALIGN float length_[kLanes];
  HWY_ALIGN float start_[kLanes];
  HWY_ALIGN float end_[kLanes];
};

/// The weights that hold positions (m + u) total / count of the line, m = i, i + 1, ...
HWY_INLINE VI SystematicPicks(const RunningSums& sums, float total, float u, std::size_t i,
                              std::size_t count) {
  const DF d;
  const VF m =
      hn::Min(hn::Iota(d, static_cast<float>(i)), hn::Set(d, static_cast<float>(count - 1)));
  return sums.Find(
      hn::Mul(hn::Add(m, hn::Set(d, u)), hn::Set(d, total / static_cast<float>(count))));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
