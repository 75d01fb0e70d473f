#pragma once

#include <vector>

#include "common/job/job_spec.h"
#include "common/job/time.h"

namespace baton {

/// How frames, sweeps, steps and runs of a job follow from each other: the one place where one
/// becomes another. A few numbers and one step a run; the job need not outlive it.
class Timeline {
 public:
  explicit Timeline(const JobSpec& job);

  std::int32_t num_frames() const { return num_frames_; }
  std::int32_t num_steps() const { return num_steps_; }
  std::int32_t num_runs() const { return static_cast<std::int32_t>(starts_.size()); }

  /// step in [0, num_steps()).
  FrameIndex frame_of(Step step) const { return FrameIndex(step.value() % num_frames_); }
  Sweep sweep_of(Step step) const { return Sweep(step.value() / num_frames_); }
  Step step_of(FrameIndex frame, Sweep sweep) const {
    return Step(sweep.value() * num_frames_ + frame.value());
  }
  /// The step whose films make the frame: that of the last sweep.
  Step last_step_of(FrameIndex frame) const {
    return Step(num_steps_ - num_frames_ + frame.value());
  }

  /// run in [0, num_runs()).
  StepSpan steps_of(Run run) const;
  /// The run that renders a step.
  Run run_of(Step step) const;
  /// First steps of the runs, ascending, from 0: those of JobSpec::leading_runs, and after the last
  /// of them every multiple of frames_per_run() in a sweep.
  const std::vector<Step>& run_starts() const { return starts_; }

 private:
  std::int32_t num_frames_, num_steps_;
  std::vector<Step> starts_;
};

/// Frames of a run: state.checkpoint_every, or 1 where pixels take samples from others, since a
/// tile then needs its neighbours.
std::int32_t frames_per_run(const JobSpec& job);
/// Timeline::num_steps and num_runs, in constant time where no run is shorter than others.
std::int32_t num_steps(const JobSpec& job);
std::int32_t num_runs(const JobSpec& job);
/// Runs from one checkpoint to the next: those in state.checkpoint_every frames.
std::int32_t runs_per_checkpoint(const JobSpec& job);
/// Whether what is lost later is made again from the states of this run, or they are the job's
/// last: those must be durable, all else that tasks hand to each other can be made again.
bool ends_in_checkpoint(const JobSpec& job, Run run);
/// How many frames from the first on two jobs have in common. Where samples are carried, only these
/// have the same history.
std::int32_t num_common_frames(const JobSpec& a, const JobSpec& b);

}  // namespace baton
