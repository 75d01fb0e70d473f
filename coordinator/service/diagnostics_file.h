#pragma once

#include <map>
#include <string>
#include <vector>

#include "coordinator/journal/journal.h"

namespace baton {

/// Header line of diagnostics.csv.
std::string diagnostics_header();

/// The lines of the frames of one run: for each frame the sum over its tiles (tile `all`), then
/// tile by tile. stats: in any order. qualities: of written frames, by index, for the lines of the
/// sums. frame_numbers: the user's, by 0-based index.
std::string diagnostics_lines(std::vector<FrameStats> stats,
                              const std::map<std::int32_t, FrameQuality>& qualities,
                              const std::vector<int>& frame_numbers);

/// Writes diagnostics.csv beside the job's frames from what the journal has recorded, whole or not
/// at all. A job that has rendered nothing gets no file.
Status write_diagnostics(Journal& journal, const Digest& digest, const JobSpec& job);

}  // namespace baton
