#pragma once

#include <vector>

#include "jobs/lab/stability/cases.h"
#include "jobs/lab/stability/laws.h"
#include "jobs/lab/stability/observe.h"
#include "jobs/lab/stability/truth.h"

namespace baton::stability {

/// One judged frame of one subject, for the plots.
struct FramePoint {
  int frame = 0;
  double lns_mean = 1, lns_median = 1;  ///< Lns^/Lns over lit pixels and renderings
  double lns_low = 1, lns_high = 1;     ///< 5th and 95th percentile of that ratio
  double bias = 0;                      ///< mean radiance / exact - 1
  double noise = 0;                     ///< root mean square error / mean radiance
  double ess = 0;                       ///< mean ESS / N
};

struct Summary {
  Numbers numbers;
  /// Frames whose exact answer is black are left out.
  std::vector<FramePoint> series;
};

/// Compares observations with the exact answer. truth.frames are the judged frames of `time`.
Summary summarise(const Timeline& time, const Truth& truth, const Observations& seen);

}  // namespace baton::stability
