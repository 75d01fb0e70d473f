#pragma once

#include "common/job/job_spec.h"

namespace baton {

/// How many sweeps a job of this quality should have next: twice as many, or fewer where the noise
/// so far, the time or maxRounds say so; as many as it has: it is clean enough, or must end. noise:
/// of its noisiest frame in Cycles' measure, 0: not known. seconds: taken so far by `timed` of its
/// sweeps; below zero the clock was set back, and no more time is taken.
int next_sweeps(const QualitySpec& quality, float noise, double seconds, int timed);

}  // namespace baton
