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

/// How the place of a frame looks from this machine.
struct FramePlace {
  bool is_free = false;  ///< nothing is there
  /// What must stay. nullopt: nothing is there, or no whole picture, or the same bytes, or what may
  /// be replaced.
  std::optional<PictureInPlace> stays = {};
};

/// made: the digest of the frame's bytes. may_replace: of pictures that may go. A picture that any
/// job has locked stays, whatever it is (common/store/frame_locks.h): a worker is not asked to
/// write what its own job has locked, as far as its coordinator knows. Errors, io: what is there,
/// or the locks, cannot be read now.
Result<FramePlace> look_at_place(const std::filesystem::path& frame, const Digest& made,
                                 const std::vector<Digest>& may_replace);

}  // namespace baton
