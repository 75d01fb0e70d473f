#pragma once

#include "jobs/study/run_record.h"

namespace baton {

/// CPU microseconds of counted work by fixed unit costs: a stand-in for time that is the same on
/// every run and machine, for choices that must be repeatable. The units are a least-squares fit
/// over the runs of jobs/studies/real-scenes.json (docs/charts.md names machine and residual).
double counted_cost_us(const RunCounts& counts);

}  // namespace baton
