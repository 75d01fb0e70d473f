#pragma once

#include <filesystem>
#include <string>

#include "common/base/bytes.h"
#include "common/base/result.h"

namespace baton {

/// Whether every attribute of an EXR file's headers is as long as it says, and its image no larger
/// than an image may be. OpenEXR believes them: a text of a few bytes that claims gigabytes, or a
/// row of 16 million pixels, costs gigabytes.
Status check_exr_attributes(const std::filesystem::path& path);
/// Of bytes that were read from a file of this name.
Status check_exr_attributes(const std::string& name, ByteView exr);
/// Whether the header of such a file, which is whole, asks for what is not read here: sides that no
/// image may have, a compression that is not known; and no worker has written it. Whether the rest
/// is whole cannot be said then.
bool exceeds_reader(ByteView exr);

}  // namespace baton
