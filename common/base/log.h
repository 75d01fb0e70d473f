#pragma once

#include <filesystem>
#include <string_view>

#include "common/base/result.h"

namespace baton {

/// Sends spdlog to stderr with the program's name in each line. level: trace, debug, info, warn,
/// error, off. BATON_LOG in the environment is the default level; an unknown level means info.
void init_logging(std::string_view program, std::string_view level = "");

/// After init_logging(): what is said from now on goes to the end of a file, too, messages of the
/// level debug included. Once it has kMaxLogFileBytes it is put aside as "NAME.1.log", in place of
/// the one before. Its folder is made, for the owner alone. Errors, io: the disk.
Status log_to_file(const std::filesystem::path& file);
inline constexpr std::size_t kMaxLogFileBytes = 4u << 20;

}  // namespace baton
