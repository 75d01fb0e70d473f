#include "coordinator/service/frame_files.h"

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {

bool FrameFiles::holds(const std::filesystem::path& path, const BlobRef& image) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size != image.size_bytes) return false;
  const auto time = std::filesystem::last_write_time(path, error);
  if (error) return false;
  const auto known = files_.find(path);
  if (known != files_.end() && known->second.size_bytes == size && known->second.time == time)
    return known->second.digest == image.digest;

  const Result<Bytes> bytes = read_file(path, limits::kMaxBlobBytes);
  if (!bytes) return false;
  if (files_.size() >= limits::kMaxFrames) files_.clear();
  const Digest digest = digest_of(*bytes);
  files_.insert_or_assign(path, Content{size, time, digest});
  return digest == image.digest;
}

}  // namespace baton
