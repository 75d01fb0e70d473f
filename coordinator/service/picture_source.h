#pragma once

#include <vector>

#include "common/job/job_spec.h"
#include "common/protocol/messages.h"
#include "coordinator/schedule/job_tasks.h"

namespace baton {

/// Where a frame of a job can be seen: in its file or, where a part of one is asked for, in the
/// films of its finished tiles. Without a number it is the last frame that is written, or the first
/// that is not. Identity and store are left empty. Errors, bad_input: the job has no such frame;
/// nothing of it is there.
Result<PictureSource> find_picture(const JobSpec& spec, const JobTasks& tasks,
                                   const AskPicture& question);
/// The same of a job that has ended, of which only whole frames are there. done: ascending by
/// place.
Result<PictureSource> find_written_picture(const JobSpec& spec,
                                           const std::vector<FrameNumber>& done,
                                           const AskPicture& question);

}  // namespace baton
