#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/base/files.h"
#include "coordinator/journal/journal.h"

namespace baton {

/// Header line of diagnostics.csv.
std::string diagnostics_header();

/// What the sampler did with a tile of a frame, over all sweeps.
struct TileDiagnostics {
  FrameIndex frame{};
  std::int32_t tile = 0;
  SamplingStats sampling;
};

/// The lines of the frames of one run: for each frame the sum over its tiles (tile `all`), then
/// tile by tile. tiles: in any order. qualities: those of written frames, for the lines of the
/// sums. frames: JobSpec::frames.
std::string diagnostics_lines(std::vector<TileDiagnostics> tiles,
                              const std::map<FrameIndex, FrameQuality>& qualities,
                              const std::vector<FrameNumber>& frames);

/// Writes diagnostics.csv beside the job's frames from what the journal has recorded, whole or not
/// at all. A job that has rendered nothing gets no file.
Status write_diagnostics(Journal& journal, const Digest& digest, const JobSpec& job,
                         const Roots& roots);

}  // namespace baton
