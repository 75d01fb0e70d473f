#include "jobs/study/unit_costs.h"

namespace baton {
namespace {

/// Microseconds of one of each.
struct UnitCosts {
  double pixel;       ///< surfaces, film, the pixel's share of its sampler
  double shadow_ray;  ///< trace and shade; with a second pass, of either pass
  double evaluation;
  double move;  ///< a proposal's random numbers and choice, with what it evaluates
};

UnitCosts units_of(const JobSpec& job) {
  if (job.visibility.correlated) return {1.50, 0.150, 0.0044, 0.0200};
  switch (job.sampling.method) {
    case Method::sequential:
      return {1.46, 0.121, 0, 0.0200};
    case Method::pool:
      return {1.98, 0.115, 0.0116, 0};
    case Method::bidirectional:
      return {0.98, 0.107, 0.0044, 0};
    default:
      return {1.06, 0.109, 0.0040, 0};
  }
}

}  // namespace

double counted_cost_us(const JobSpec& job, const RunCounts& counts) {
  const auto count = [](std::uint64_t n) { return static_cast<double>(n); };
  const UnitCosts unit = units_of(job);
  return unit.pixel * count(counts.lit_pixels()) + unit.shadow_ray * count(counts.rays_shadow) +
         unit.evaluation * count(counts.target_evaluations) +
         unit.move * count(counts.moves_proposed);
}

}  // namespace baton
