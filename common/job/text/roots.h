#pragma once

#include <filesystem>

#include "common/base/files.h"
#include "common/job/text/job_json.h"

namespace baton {

/// Whether a path, its links followed, lies in one of the roots; it need not exist yet. A link that
/// leads nowhere lies in none.
bool lies_within(const std::filesystem::path& path, const Roots& roots);

/// bad_input names the path that lies outside.
Status check_output_root(const JobSpec& job, const Roots& roots);
/// As check_output_root(), for all files that the job reads, too.
Status check_roots(const ParsedJobDocument& document, const Roots& roots);

}  // namespace baton
