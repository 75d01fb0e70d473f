#include "jobs/study/unit_costs.h"

namespace baton {
namespace {

/// Microseconds of one of each. A move costs what it evaluates.
struct UnitCosts {
  double pixel;       ///< surfaces, film, the pixel's share of its sampler
  double shadow_ray;  ///< trace and shade; with a second pass, of either pass
  double evaluation;
};

UnitCosts units_of(const JobSpec& job) {
  // Fitted with one M alone, so the evaluations are those of bidirectional.
  if (job.visibility.correlated) return {2.50, 0.101, 0.0020};
  switch (job.sampling.method) {
    case Method::sequential:
      return {1.44, 0.087, 0.0075};
    case Method::pool:
      return {2.07, 0.117, 0.0110};
    case Method::bidirectional:
      return {1.00, 0.080, 0.0020};
    case Method::mis:
      return {1.37, 0.073, 0.0};
    default:
      return {0.76, 0.075, 0.0025};
  }
}

}  // namespace

double counted_cost_us(const JobSpec& job, const RunCounts& counts) {
  const auto count = [](std::uint64_t n) { return static_cast<double>(n); };
  const UnitCosts unit = units_of(job);
  return unit.pixel * count(counts.lit_pixels()) + unit.shadow_ray * count(counts.rays_shadow) +
         unit.evaluation * count(counts.target_evaluations);
}

}  // namespace baton
