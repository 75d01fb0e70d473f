#pragma once

#include "common/job/job_spec.h"
#include "jobs/study/run_record.h"

namespace baton {

/// CPU microseconds of a job's counted work by fixed unit costs: a stand-in for time that is the
/// same on every run and machine, for choices that must be repeatable. The units are a fit to the
/// runs of jobs/studies/unit-costs.json (docs/charts.md names machine and residual).
double counted_cost_us(const JobSpec& job, const RunCounts& counts);

/// The same of the light of all frames of a job under maps of `file_texels` that are reduced to
/// `texels`: reading, reducing and mixing maps, tables and pools.
double counted_light_us(const JobSpec& job, double file_texels, double texels);

}  // namespace baton
