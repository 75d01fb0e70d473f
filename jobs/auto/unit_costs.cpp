#include "jobs/auto/unit_costs.h"

#include <algorithm>
#include <cmath>

#include "common/scene/scene.h"

namespace baton {
namespace {

/// Constants of the fit to jobs/studies/ray-costs.json.
constexpr double kFittedTriangles = 75'000;
constexpr double kTriangleExponent = 0.14;
constexpr double kMovingFactor = 3;

/// Microseconds of one of each. A move costs what it evaluates.
struct UnitCosts {
  /// Surfaces, film, the pixel's share of its sampler.
  double pixel;
  /// Trace and shade; with a second pass, of either pass.
  double shadow_ray;
  double evaluation;
};

UnitCosts units_of(const JobSpec& job) {
  // Fitted with one M alone, so the evaluations are those of bidirectional.
  if (job.visibility.correlated) return {2.50, 0.101, 0.0020};
  switch (job.sampling.method) {
    case Method::sequential:
      return {1.44, 0.087, 0.0075};
    case Method::pool:
      return {1.35, 0.090, 0.0036};
    case Method::bidirectional:
      return {1.00, 0.080, 0.0020};
    case Method::mis:
      return {1.37, 0.073, 0.0};
    default:
      return {0.76, 0.075, 0.0025};
  }
}

}  // namespace

double ray_cost_factor(std::uint64_t num_triangles, bool objects_move) {
  const auto triangles = static_cast<double>(std::max<std::uint64_t>(num_triangles, 1));
  const double factor = std::pow(triangles / kFittedTriangles, kTriangleExponent);
  return objects_move ? kMovingFactor * factor : factor;
}

Result<double> ray_cost_factor(const JobSpec& job) {
  BATON_ASSIGN(const Scene scene, load_scene(job));
  std::uint64_t num_triangles = 0;
  bool objects_move = false;
  for (const Instance& instance : scene.instances) {
    num_triangles += scene.meshes[instance.mesh].triangles.size();
    objects_move = objects_move || instance.moves();
  }
  return ray_cost_factor(num_triangles, objects_move);
}

double counted_cost_us(const JobSpec& job, double ray_factor, const RunCounts& counts) {
  const auto count = [](std::uint64_t n) { return static_cast<double>(n); };
  const UnitCosts unit = units_of(job);
  return unit.pixel * count(counts.lit_pixels()) +
         ray_factor * unit.shadow_ray * count(counts.rays_shadow) +
         unit.evaluation * count(counts.target_evaluations);
}

}  // namespace baton
