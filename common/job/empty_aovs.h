#pragma once

#include <string_view>

#include "common/job/job_spec.h"

namespace baton {

/// Why an AOV shows nothing of this job: it is the same everywhere. Empty: it shows something.
std::string_view why_empty(Aov aov, const JobSpec& job);

}  // namespace baton
