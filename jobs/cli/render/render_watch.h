#pragma once

#include "common/base/exit_codes.h"
#include "jobs/cli/render/render_session.h"

namespace baton {

/// What the pictures of a job depend on, as a text that changes with it: every value of the job, or
/// what is wrong with it, and time and size of each file that it names. Files are not read.
std::string watched_state(const JobArgument& argument);

/// Renders the job's look, coarse first, and again each time that watched_state changes, until the
/// user asks to stop. What is wrong with a job is printed; its next version may be better. Errors:
/// those of the first version, and of the farm.
Result<ExitCode> watch_and_render(const RenderOptions& options);

}  // namespace baton
