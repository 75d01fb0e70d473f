#pragma once

#include <string_view>

namespace baton {

/// Sends spdlog to stderr with the program's name in each line. level: trace, debug, info, warn,
/// error, off. BATON_LOG in the environment is the default level; an unknown level means info.
void init_logging(std::string_view program, std::string_view level = "");

}  // namespace baton
