#pragma once

#include <string>

#include "common/base/bytes.h"

namespace baton {

/// A frame's header has a seal: the digest of its file's name and of all its bytes, with zeros in
/// the seal's place. Who paints a frame or lays it in another one's place may keep its header, and
/// breaks the seal by that: the file is not what a worker wrote there.
inline constexpr char kSealAttribute[] = "baton:seal";
/// The value to encode; seal_frame() replaces it.
std::string blank_seal();

/// Seals an EXR whose header has kSealAttribute with blank_seal(). name: of the file, without its
/// folder. The header must have the attribute.
void seal_frame(const std::string& name, Bytes& exr);
/// Whether the file is as it was sealed, under its name. False without a seal.
bool is_sealed(const std::string& name, Bytes exr);

}  // namespace baton
