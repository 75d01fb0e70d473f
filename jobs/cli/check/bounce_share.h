#pragma once

#include <string>

#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton {

/// What light between surfaces adds to what is seen of a job, over its direct light; >= 0. By
/// luminance, of surfaces that reflect some.
struct BounceShare {
  double whole = 0;
  /// That has most beside its own direct light; empty: none is lit.
  std::string material;
  double of_material = 0;
};
/// From a picture of some 2,300 pixels of the middle frame, which a worker of its own renders:
/// known to some per cent. job: settled, with bounces. Errors: those of a local farm.
Result<BounceShare> bounce_share(const JobSpec& job);
/// "9 %, most on `gold` (74 %)".
std::string text_of(const BounceShare& share);

}  // namespace baton
