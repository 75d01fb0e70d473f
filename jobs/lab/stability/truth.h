#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton::stability {

/// The exact answer of one frame: (pixels), mean over R, G, B.
struct FrameTruth {
  std::vector<double> lns;
  std::vector<double> radiance;
};

struct Truth {
  std::vector<FrameTruth> frames;  ///< in the order of job.frames
  /// RMS difference to half as many nodes / mean radiance, first lit frame.
  double quadrature_error = 0;
};

/// Sums f cos L V over all texels of the map: a midpoint rule of nodes x nodes points in each
/// texel, scalar materials and lookups, one shadow ray a point. Shares nothing with the samplers
/// but the ray tracer. nodes: even, so that the creases of bilinear maps lie between points. job:
/// one site.
Result<Truth> exact_truth(const JobSpec& job, int nodes, int threads);

}  // namespace baton::stability
