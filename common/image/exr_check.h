#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace baton {

/// A text in the header of an EXR of any kind, all of whose pixels can be decoded; empty: it has
/// none of this name. nullopt: the file is no such EXR, as one that was cut or whose packed bytes
/// are damaged. Reads the whole file.
std::optional<std::string> text_of_whole_exr(const std::filesystem::path& path,
                                             const std::string& attribute);

}  // namespace baton
