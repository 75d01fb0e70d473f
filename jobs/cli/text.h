#pragma once

#include <cstdint>
#include <string>

namespace baton {

/// "512 B", "1.5 KiB", "3.2 GiB".
std::string bytes_text(std::uint64_t bytes);

/// "950", "12.3 k", "4.6 M", "7.8 G".
std::string count_text(std::uint64_t count);

/// "7s", "3m05s", "2h03m"; seconds >= 0.
std::string duration_text(double seconds);

/// "exposure +1.5 stops".
std::string exposure_text(float stops);

/// "25.0%"; whole 0 gives "0.0%".
std::string percent_text(std::uint64_t part, std::uint64_t whole);

}  // namespace baton
