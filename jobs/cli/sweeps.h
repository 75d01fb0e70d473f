#pragma once

#include <chrono>

#include "common/job/job_spec.h"

namespace baton {

/// Makes a job that may grow refinable, and has it go on with the sweeps of the frames that are
/// there. afresh: they are replaced. Returns how many of its sweeps these have.
int begin_sweeps(JobSpec& job, bool afresh);

/// Adds sweeps to a job until quality.noiseThreshold, maxRounds or timeLimit ends it. Each time it
/// is twice as many, so that frames after 1, 2, 4 ... times quality.rounds can be looked at, or as
/// many as the noise so far asks for, if those are fewer.
///
/// What is averaged decides how long it goes on, but only through one number of a whole frame, the
/// rms over thousands of probes, so what one pixel found moves its own number of rounds by less
/// than a thousandth: docs/build/rounds.md says how large the bias can be. A pixel has no say of
/// its own.
class MoreSweeps {
 public:
  /// Begins the job (begin_sweeps).
  MoreSweeps(JobSpec& job, bool afresh) : first_sweeps_(begin_sweeps(job, afresh)) {}

  /// After the job is done: whether it has more sweeps now; says why on stderr.
  bool add_to(JobSpec& job);

 private:
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start_ = Clock::now();
  const int first_sweeps_;  ///< done before that time, or 0
};

}  // namespace baton
