#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/job/time.h"

namespace baton {

/// Frame numbers from text: "7", "1-48", "1-100x2" (every second one) and lists of them:
/// "1,5,9-12". Ascending, no duplicates, each in [0, limits::kMaxFrameNumber], at most
/// limits::kMaxFrames. The error's message is of the form "expected ..., got ...".
Result<std::vector<FrameNumber>> parse_frames(std::string_view text);

/// A short text of that kind; parse_frames(format_frames(f)) == f for ascending f.
std::string format_frames(const std::vector<FrameNumber>& frames);

}  // namespace baton
