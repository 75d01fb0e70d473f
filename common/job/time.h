#pragma once

#include <cstdint>

#include "common/base/ordinal.h"

namespace baton {

/// The words for time. Each is a type of its own, so that the compiler refuses mixtures; what one
/// is in another is asked of a Timeline (common/job/plan/timeline.h) alone.

/// What a person types and reads in file names: "frame 1001". In [0, limits::kMaxFrameNumber].
using FrameNumber = Ordinal<struct FrameNumberTag>;
/// Place of a frame in JobSpec::frames, from 0.
using FrameIndex = Ordinal<struct FrameIndexTag>;
/// A job renders its frames quality.sweeps times over; a sweep is one pass over all of them. From
/// 0.
using Sweep = Ordinal<struct SweepTag>;
/// Place in what is rendered, from 0: step s is frame index s % frames of sweep s / frames. What is
/// carried goes from step to step.
using Step = Ordinal<struct StepTag>;
/// Place among the runs of a tile, from 0. A run is the steps of one lease.
using Run = Ordinal<struct RunTag>;
/// One of the renderings that a step is the mean of, from 0; negative: before those that are seen
/// (state.preroll).
using Round = Ordinal<struct RoundTag>;

/// Steps from the first to the last, both included.
struct StepSpan {
  Step first, last;

  bool operator==(const StepSpan&) const = default;
  constexpr std::int32_t size() const { return last - first + 1; }
  constexpr bool empty() const { return size() == 0; }
  constexpr bool contains(Step step) const { return first <= step && step <= last; }
};

}  // namespace baton
