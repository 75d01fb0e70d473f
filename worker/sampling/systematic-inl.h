// Systematic choice from running sums in SIMD. Included once per Highway target.
#if defined(BATON_WORKER_SAMPLING_SYSTEMATIC_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SAMPLING_SYSTEMATIC_INL_H_
#undef BATON_WORKER_SAMPLING_SYSTEMATIC_INL_H_
#else
#define BATON_WORKER_SAMPLING_SYSTEMATIC_INL_H_
#endif

#include <hwy/highway.h>

#include <bit>

#include "common/base/limits.h"
#include "common/math/lanes-inl.h"
#include "common/math/padded_array.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Weights on a line, lane by lane in the order of the van der Corput sequence: those at 0, 8, 16,
/// ..., then those at 4, 12, ..., at 2, 6, 1, 5, 3 and 7 and so on. Eight stretches grow at once,
/// and what is stored are their lengths so far, which never fall. Where eight neighbours are points
/// of a low-discrepancy sequence, which jumps to and fro, this order goes through them smoothly.
class RunningSums {
 public:
  /// Where the line ends so far. A loop that appends works on a copy of it, in registers.
  struct End {
    float* next;
    VF sum;

    /// Appends a vector of non-negative weights.
    HWY_INLINE void Add(VF weight) {
      sum = hn::Add(sum, weight);
      hn::Store(sum, DF(), next);
      next += hn::Lanes(DF());
    }
  };
  End end;

  /// storage: room for all vectors, aligned.
  explicit RunningSums(float* storage) : end{storage, hn::Zero(DF())}, storage_(storage) {}

  /// Ends the line: fixes where each lane's stretch ends and returns the sum of all weights.
  HWY_INLINE float Finish() {
    size_ = static_cast<std::size_t>(end.next - storage_);
    hn::Store(end.sum, DF(), length_);
    float total = 0;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const auto lane = static_cast<std::size_t>(kLaneOf[k]);
      start_[lane] = total;
      total += length_[lane];
      stop_[k] = total;
      if (length_[lane] > 0) last_ = static_cast<std::int32_t>(k);
    }
    return total;
  }

  static constexpr std::size_t kGroup = 2 * hn::MaxLanes(DF());
  static_assert(kGroup <= kVectorPadding);

  /// After Finish: the weights that contain kGroup positions, each in [0, total], total > 0; never
  /// one of weight 0. Two searches go side by side: one alone waits for its own lookups.
  HWY_INLINE void Find(const VF (&position)[2], std::int32_t* found) const {
    const DF d;
    const DI di;
    // The first stretch that ends later, and its lane; rounding past the end counts to the last.
    VI lane[2], vector[2];
    VF along[2];
    for (std::size_t g = 0; g < 2; ++g) {
      lane[g] = vector[g] = hn::Zero(di);
      for (std::size_t k = 0; k + 1 < kLanes; ++k) {
        const auto passed = hn::Le(hn::Set(d, stop_[k]), position[g]);
        lane[g] = hn::Sub(lane[g], hn::VecFromMask(di, hn::RebindMask(di, passed)));
      }
      const auto stretch = hn::IndicesFromVec(di, hn::Min(lane[g], hn::Set(di, last_)));
      lane[g] = hn::TableLookupLanes(hn::Load(di, kLaneOf), stretch);
      const auto its = hn::IndicesFromVec(d, lane[g]);
      const VF longest =
          hn::Mul(hn::TableLookupLanes(hn::Load(d, length_), its), hn::Set(d, 1 - 0x1p-23f));
      const VF start = hn::TableLookupLanes(hn::Load(d, start_), its);
      along[g] = hn::Min(hn::Sub(position[g], start), longest);
    }

    // Within it, the first sum that exceeds the position.
    const auto vectors = static_cast<std::uint32_t>(size_ / kLanes);
    const VI last = hn::Set(di, static_cast<std::int32_t>(vectors) - 1);
    constexpr int kShift = std::countr_zero(kLanes);
    for (std::uint32_t step = std::bit_ceil(vectors) / 2; step > 0; step /= 2) {
      for (std::size_t g = 0; g < 2; ++g) {
        const VI next = hn::Add(vector[g], hn::Set(di, static_cast<std::int32_t>(step)));
        const VI probe = hn::Min(hn::Sub(next, hn::Set(di, 1)), last);
        const VI at = hn::Add(hn::ShiftLeft<kShift>(probe), lane[g]);
        const auto passed = hn::Le(hn::GatherIndex(d, storage_, at), along[g]);
        vector[g] = hn::IfThenElse(hn::RebindMask(di, passed), next, vector[g]);
      }
    }
    for (std::size_t g = 0; g < 2; ++g) {
      const VI index = hn::Add(hn::ShiftLeft<kShift>(hn::Min(vector[g], last)), lane[g]);
      hn::StoreU(index, di, found + g * kLanes);
    }
  }

 private:
  static constexpr std::size_t kLanes = hn::MaxLanes(DF());
  static_assert(kLanes == 4 || kLanes == 8);
  /// Lane of the k-th stretch: its bits reversed.
  HWY_ALIGN static constexpr std::int32_t kLaneOf[] = {0, kLanes / 2, kLanes / 4, 3 * kLanes / 4,
                                                       1, 5,          3,          7};
  float* storage_;
  std::size_t size_ = 0;            ///< weights, padded
  std::int32_t last_ = 0;           ///< last stretch with a length
  HWY_ALIGN float length_[kLanes];  ///< by lane
  HWY_ALIGN float start_[kLanes];   ///< by lane
  HWY_ALIGN float stop_[kLanes];    ///< by stretch
};

/// picks: the weights that contain positions (m + u) total / count of the line, m in [0,
/// count), and what fills up the last group.
HWY_INLINE void SystematicPicks(const RunningSums& sums, float total, float u, std::size_t count,
                                PaddedArray<std::int32_t, limits::kMaxParticles>& picks) {
  const DF d;
  const VF last = hn::Set(d, static_cast<float>(count - 1));
  const VF stride = hn::Set(d, total / static_cast<float>(count));
  const auto position = [&](std::size_t m) HWY_ATTR {
    const VF number = hn::Min(CountFrom(d, static_cast<float>(m)), last);
    return hn::Mul(hn::Add(number, hn::Set(d, u)), stride);
  };
  for (std::size_t m = 0; m < count; m += RunningSums::kGroup) {
    sums.Find({position(m), position(m + hn::Lanes(d))}, picks.from(m));
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
