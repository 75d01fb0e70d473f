#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"
#include "jobs/cli/job_argument.h"

namespace baton {

/// Makes a folder whose frames only look on, a look's or a comparison's, or sees that it is one, so
/// that whatever is in it may be replaced. way_on: what keeps what is in it, for people. Errors:
/// bad_input, files are in it, and it is none; io.
Status claim_look_folder(const std::filesystem::path& folder, std::string_view way_on);

/// Before a job is rendered: claims the folder of a look, and sees that any other job's is none,
/// where the next look would replace its frames. restart: the folder of a look becomes one whatever
/// is in it. Errors: those of claim_look_folder.
Status claim_output(const WantedJob& wanted, bool restart);

}  // namespace baton
