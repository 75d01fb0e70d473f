#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace baton {

/// The job that wrote an EXR of any kind, all of whose pixels can be decoded, as digits of its
/// digest (`baton:jobDigest`); empty: it is not as a worker wrote it, under this name
/// (frame_seal.h). nullopt: the file is no such EXR, as one that was cut or whose packed bytes are
/// damaged. Reads the whole file.
std::optional<std::string> writer_of_frame(const std::filesystem::path& path);

}  // namespace baton
