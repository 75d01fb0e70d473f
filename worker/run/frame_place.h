#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"

namespace baton {

/// A whole picture in the place of a frame.
struct PictureInPlace {
  Digest digest;
  /// The job that its header names, in hexadecimal digits; empty: none.
  std::string writer;
};

/// What must stay in the place of a frame whose bytes have the digest `made`. nullopt: nothing is
/// there, or no whole picture, or the same bytes, or one of `may_replace`. Error, io: what is
/// there cannot be read.
Result<std::optional<PictureInPlace>> find_picture_in_place(const std::filesystem::path& frame,
                                                            const Digest& made,
                                                            const std::vector<Digest>& may_replace);

}  // namespace baton
