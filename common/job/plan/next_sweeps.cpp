#include "common/job/plan/next_sweeps.h"

#include <algorithm>
#include <cmath>

#include "common/base/limits.h"

namespace baton {

int next_sweeps(const QualitySpec& quality, float noise, double seconds, int timed) {
  const int sweeps = quality.sweeps;
  std::int64_t next = 2 * std::int64_t{sweeps};
  if (quality.noise_threshold) {
    if (noise > 0 && noise <= *quality.noise_threshold) return sweeps;
    const double ratio = double{noise} / double{*quality.noise_threshold};
    if (noise > 0)
      next = std::min(next, static_cast<std::int64_t>(std::ceil(sweeps * ratio * ratio)));
  }
  const int most = quality.max_rounds > 0 ? quality.max_rounds : limits::kMaxRounds;
  next = std::min<std::int64_t>(next, most / quality.rounds);
  if (quality.time_limit && timed > 0) {
    if (seconds < 0) return sweeps;
    const double room = double{*quality.time_limit} - seconds;
    const double a_sweep = std::max(seconds / timed, 1e-6);
    next = std::min(next, sweeps + static_cast<std::int64_t>(std::floor(room / a_sweep)));
  }
  return static_cast<int>(std::max<std::int64_t>(next, sweeps));
}

}  // namespace baton
