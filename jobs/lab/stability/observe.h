#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/job/task.h"
#include "jobs/lab/stability/cases.h"

namespace baton::stability {

/// What a subject made of a case in independent renderings. Index: (judged frames, renderings,
/// pixels).
struct Observations {
  using Values = std::vector<std::vector<std::vector<float>>>;

  Values radiance;  ///< mean over R, G, B
  Values lns;
  /// (judged frames) means over renderings and surface pixels; ess: over N.
  std::vector<double> ess, acceptance;
  /// Values of any frame that are NaN or infinite.
  std::uint64_t unlawful = 0;
  /// Pixels of all frames with a value below 0, and all pixels.
  std::uint64_t negative = 0, pixels = 0;
  /// Sums over all renderings and frames; light is shared by the subjects.
  RenderStats stats;
};

/// Renders every frame of the case's job with every subject `runs` times with seeds 1, 2, ... in
/// this process. Returns (subjects). job: as built by the case.
Result<std::vector<Observations>> observe(const JobSpec& job, const Timeline& time,
                                          const std::vector<Subject>& subjects, int runs,
                                          int threads);

}  // namespace baton::stability
