#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace baton {

/// A coordinator has a file descriptor for each worker and client. As many as the system allows
/// this process, whatever the shell has set.
void raise_file_limit();

/// Why no more workers are taken: the descriptors that are left are for clients, the journal and
/// files. nullopt: there is room, or nobody can say. list: a folder of those that are open.
std::optional<std::string> lack_of_descriptors(const std::filesystem::path& list = "/proc/self/fd");

}  // namespace baton
