#pragma once

#include <string>
#include <vector>

#include "common/base/bytes.h"

namespace baton {

/// By its first bytes.
bool is_jpeg(ByteView bytes);

/// What is odd about a JPEG file that decoders read without a word, a line each: no mark at its
/// end, so that a part of the picture may be missing, which they make up; CMYK without Adobe's
/// mark, which says whether the file has amounts of ink or of light.
std::vector<std::string> jpeg_notes(ByteView bytes);

}  // namespace baton
