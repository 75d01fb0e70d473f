#pragma once

#include <optional>
#include <string>

#include "common/base/bytes.h"

namespace baton {

/// The job that wrote an EXR of any kind, all of whose pixels can be decoded, as digits of its
/// digest (`baton:jobDigest`) and, after a blank, what rendered it (`baton:renderer`); empty: it is
/// not as a worker wrote it, under this name (frame_seal.h). nullopt: the bytes are no such EXR, as
/// of a file that was cut or whose packed bytes are damaged; where that cannot be told, they are
/// somebody's picture (exceeds_reader). name: of the file, without its folder.
/// exr: all of it, as it was read, so that a disk that fails between two looks changes no verdict.
std::optional<std::string> writer_of_frame(const std::string& name, const Bytes& exr);

}  // namespace baton
