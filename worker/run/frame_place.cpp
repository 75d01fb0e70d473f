#include "worker/run/frame_place.h"

#include <algorithm>
#include <utility>

#include "common/base/file_stamp.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/image/exr_check.h"
#include "common/store/frame_locks.h"

namespace baton {

Result<FramePlace> look_at_place(const std::filesystem::path& frame, const Digest& made,
                                 const std::vector<Digest>& may_replace) {
  // Whatever an error is of, it may have gone in a moment.
  const auto of_the_moment = [](const Error& error) { return Error{ErrorKind::io, error.message}; };
  const Result<std::optional<FileStamp>> stamp = stamp_of(frame);
  if (!stamp) return of_the_moment(stamp.error());
  if (!*stamp) return FramePlace{.is_free = true};
  const Result<Bytes> bytes = read_file(frame, limits::kMaxBlobBytes);
  if (!bytes) return of_the_moment(bytes.error());
  const Digest there = digest_of(*bytes);
  if (there == made) return FramePlace{};
  const auto locks = locks_of_others(frame.parent_path(), {});
  if (!locks) return of_the_moment(locks.error());
  if (locks->contains(frame.filename().string()))
    return FramePlace{.stays = PictureInPlace{there, {}}};
  if (std::ranges::find(may_replace, there) != may_replace.end()) return FramePlace{};
  std::optional<std::string> writer = writer_of_frame(frame.filename().string(), *bytes);
  if (!writer) return FramePlace{};
  return FramePlace{.stays = PictureInPlace{there, std::move(*writer)}};
}

}  // namespace baton
