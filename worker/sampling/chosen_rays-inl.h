// Candidates that were chosen systematically and become rays, in SIMD. Included once per Highway
// target.
#if defined(BATON_WORKER_SAMPLING_CHOSEN_RAYS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SAMPLING_CHOSEN_RAYS_INL_H_
#undef BATON_WORKER_SAMPLING_CHOSEN_RAYS_INL_H_
#else
#define BATON_WORKER_SAMPLING_CHOSEN_RAYS_INL_H_
#endif

#include <hwy/highway.h>

#include "common/base/poison.h"
#include "worker/sampling/pixel_rays.h"
#include "worker/sampling/systematic-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Candidates that were chosen, each once, in the order of the line.
class DistinctPicks {
 public:
  PaddedArray<std::int32_t, limits::kMaxParticles> pick;
  PaddedArray<float, limits::kMaxParticles> times;  ///< each counts
  std::size_t count = 0;

  /// `num_picks` systematic ones from a line whose sum is `total`; both > 0.
  DistinctPicks(const RunningSums& line, float total, float u, std::size_t num_picks) {
    poison(pick);
    poison(times);
    PaddedArray<std::int32_t, limits::kMaxParticles> picks;
    poison(picks);
    SystematicPicks(line, total, u, num_picks, picks);
    for (std::size_t j = 0; j < num_picks; ++j) {
      if (j > 0 && picks[j] == picks[j - 1]) {
        times[count - 1] += 1;
        continue;
      }
      pick[count] = picks[j];
      times[count] = 1;
      ++count;
    }
    // The last vector is filled up with rays that bring nothing.
    pick.pad(count, count > 0 ? pick[0] : 0);
    times.pad(count, 0.0f);
  }
};

/// Writes a vector of rays from j on: directions, what each brings if it is free, its share of Lns.
HWY_INLINE void StoreRays(const Vec3Lanes& w, const Vec3Lanes& color, VF share, VI site,
                          std::size_t j, PixelRays& out) {
  const DF d;
  hn::Store(w.x, d, out.x.from(j));
  hn::Store(w.y, d, out.y.from(j));
  hn::Store(w.z, d, out.z.from(j));
  hn::Store(color.x, d, out.r.from(j));
  hn::Store(color.y, d, out.g.from(j));
  hn::Store(color.z, d, out.b.from(j));
  hn::Store(share, d, out.visibility.from(j));
  hn::StoreU(hn::DemoteTo(DB(), site), DB(), out.site.from(j));
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
