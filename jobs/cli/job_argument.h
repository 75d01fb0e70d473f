#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/text/job_json.h"

namespace baton {

/// A job on a command line: its file, and what is said in place of the file's values.
struct JobArgument {
  std::string file;
  std::vector<std::string> set;  ///< KEY=VALUE
  std::string frames;            ///< empty: those of the job
  std::string scale;
  std::string region;
};

/// Adds JOB and the options of add_override_options.
void add_job_argument(CLI::App& command, JobArgument& argument);
/// Adds --frames, --scale, --region and --set.
void add_override_options(CLI::App& command, JobArgument& argument);

/// What the options put into the JSON of the job, --set last.
std::vector<JobOverride> overrides_of(const JobArgument& argument);
/// The arguments of a command as they were typed, for a shell, without some of its options.
std::string typed_again(const CLI::App& command, const std::set<std::string>& without);

/// The job with the changes of a command line; motion is not settled. One that is not what its file
/// says is a look (OutputSpec::is_look), and its frames go to a folder of their own (`-look` behind
/// its name), but for a folder that the options name. `look`: even if the options change nothing.
/// Errors: load_job's.
Result<JobSpec> load_wanted(const JobArgument& argument, bool look = false);

/// Adds --from-frame; frame: none, where it is not given.
void add_from_frame_option(CLI::App& command, std::optional<FrameNumber>& frame);
/// Leaves the frames from `frame` on, so that a job begins there afresh and those before stay with
/// whichever job wrote them; says which of those are not there. Error: none is left.
Status begin_at(JobSpec& job, std::optional<FrameNumber> frame);

/// The same with settled motion, for what is rendered or estimated.
Result<JobSpec> load_settled(const JobArgument& argument, bool look = false);

}  // namespace baton
