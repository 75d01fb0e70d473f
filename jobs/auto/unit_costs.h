#pragma once

#include <cstdint>

#include "common/job/job_spec.h"
#include "jobs/study/run_record.h"

namespace baton {

/// How much dearer a shadow ray is in a scene than in those that the unit costs were fitted to:
/// (triangles / 75000)^0.14, and three times that where objects move, as rays then go through two
/// hierarchies. A rule, since only a clock could measure the price of a ray (Embree counts no
/// steps), and what `auto` chooses must not depend on one. A fit to jobs/studies/ray-costs.json: 14
/// to 3 million triangles, 0.02 to 0.16 us a ray, residual 23 % (rms) where nothing moves, as view
/// and free sky matter, too; moving scenes are 2.7 and 4.4 times as dear as still ones.
/// num_triangles: of all instances, the ground included.
double ray_cost_factor(std::uint64_t num_triangles, bool objects_move);
/// The same for the geometry of a job, which is loaded. Errors: those of load_scene.
Result<double> ray_cost_factor(const JobSpec& job);

/// CPU microseconds of a job's counted work: a stand-in for time that is the same on every
/// rendering and machine, for choices that must be repeatable. Rays count with ray_factor
/// (ray_cost_factor), the rest with fixed unit costs, a fit to the renderings of
/// jobs/studies/unit-costs.json (docs/lab/auto.md names machine and residual).
double counted_cost_us(const JobSpec& job, double ray_factor, const RunCounts& counts);

}  // namespace baton
