#pragma once

#include <string>
#include <vector>

#include "common/job/job_spec.h"

namespace baton {

/// The animations of a glTF file that moves something in a job.
struct AnimationUse {
  std::string file;
  std::vector<std::string> names;  ///< as a job may choose them, at least one
  int played = -1;                 ///< place in `names`; -1: all of them
};

/// The animations of a job as it is written (its motion is not settled): each file once for each
/// choice. Files that cannot be read, or without animations, are left out.
std::vector<AnimationUse> animations_of(const JobSpec& job);
/// Such as: set.glb: "run" plays, of "walk", "run".
std::string text_of(const AnimationUse& use);

}  // namespace baton
