#pragma once

#include <cstdint>
#include <string>

namespace baton {

/// "512 B", "1.5 KiB", "3.2 GiB".
std::string bytes_text(std::uint64_t bytes);

/// "950", "12.3 k", "4.6 M", "7.8 G".
std::string count_text(std::uint64_t count);

}  // namespace baton
