#pragma once

#include <filesystem>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton {

/// The file that a job writes for a frame number.
std::filesystem::path frame_path(const OutputSpec& output, int frame_number);

/// Writes contact-sheet.png into the output folder: at most 24 of the frames, evenly picked, all at
/// one exposure. frames: numbers of finished frames, at least one. Returns the sheet's path.
Result<std::filesystem::path> write_frame_sheet(const OutputSpec& output,
                                                const std::vector<int>& frames);

}  // namespace baton
