#pragma once

#include <string>
#include <vector>

#include "common/job/job_spec.h"

namespace baton {

/// What of the settled scene of a job is not shown, or not as someone may expect: surfaces that
/// glow, what its glTF files have and Baton does not read, materials that stand for none of such a
/// file. One line each.
std::vector<std::string> scene_warnings(const JobSpec& job);

}  // namespace baton
