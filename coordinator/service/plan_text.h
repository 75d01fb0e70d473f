#pragma once

#include <set>
#include <string>
#include <vector>

#include "coordinator/schedule/adoption.h"
#include "coordinator/schedule/scheduler.h"

namespace baton {

/// "frame 3", "frames 1-4", and what follows: "is" or "are".
std::string frames_text(const JobSpec& job, const std::set<FrameIndex>& frames);
inline const char* are(const std::set<FrameIndex>& frames) {
  return frames.size() == 1 ? "is" : "are";
}

/// What is kept of a job and what is rendered, for people, a line each: "frames 1-8 are kept",
/// "frames 9-12 are rendered, going on from the states of frame 8". Then `reasons`, why something
/// is done again. Empty where nothing is kept and there is no reason.
std::string plan_text(const Scheduler::Job& job, const std::vector<std::string>& reasons);

/// Why a new job does not keep what a former one of its picture has done, and what it keeps as it
/// is: settings of the output that differ, headers. other_plates: as of Adoption.
std::vector<std::string> output_reasons(const JobSpec& former, const JobSpec& wanted,
                                        bool other_plates);

}  // namespace baton
