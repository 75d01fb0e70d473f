#include "worker/run/frame_place.h"

#include <algorithm>

#include "common/base/file_stamp.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/image/exr_check.h"

namespace baton {

Result<std::optional<PictureInPlace>> find_picture_in_place(
    const std::filesystem::path& frame, const Digest& made,
    const std::vector<Digest>& may_replace) {
  constexpr std::optional<PictureInPlace> kNothing;
  const Result<std::optional<FileStamp>> stamp = stamp_of(frame);
  if (stamp && !*stamp) return kNothing;
  const Result<Bytes> bytes = stamp ? read_file(frame, limits::kMaxBlobBytes) : stamp.error();
  // Whatever it is, it may have gone in a moment.
  if (!bytes) return Error{ErrorKind::io, bytes.error().message};
  const Digest there = digest_of(*bytes);
  if (there == made || std::ranges::find(may_replace, there) != may_replace.end()) return kNothing;
  std::optional<std::string> writer = writer_of_frame(frame);
  if (!writer) return kNothing;
  return std::optional(PictureInPlace{there, std::move(*writer)});
}

}  // namespace baton
