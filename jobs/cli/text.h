#pragma once

#include <cstdint>
#include <string>

#include "common/base/size_text.h"

namespace baton {

/// "7s", "3m05s", "2h03m"; seconds >= 0.
std::string duration_text(double seconds);

/// "exposure +1.5 stops".
std::string exposure_text(float stops);

/// "25.0%"; whole 0 gives "0.0%".
std::string percent_text(std::uint64_t part, std::uint64_t whole);

}  // namespace baton
