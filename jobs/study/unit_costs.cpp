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
  if (job.visibility.correlated) return {2.75, 0.111, 0.0053};
  switch (job.sampling.method) {
    case Method::sequential:
      return {1.25, 0.091, 0.0082};
    case Method::pool:
      return {2.04, 0.118, 0.0148};
    case Method::bidirectional:
      return {0.92, 0.070, 0.0053};
    default:
      return {0.97, 0.080, 0.0020};
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
