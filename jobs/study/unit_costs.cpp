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
  if (job.visibility.correlated) return {2.75, 0.111, 0.0053};
  switch (job.sampling.method) {
    case Method::sequential:
      return {1.24, 0.090, 0.0082};
    case Method::pool:
      return {2.02, 0.117, 0.0147};
    case Method::bidirectional:
      return {0.91, 0.070, 0.0053};
    case Method::mis:
      return {1.36, 0.036, 0.0382};
    default:
      return {0.82, 0.072, 0.0011};
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
