#include "coordinator/service/file_table.h"

#include <sys/stat.h>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {

Result<Digest> digest_of_file(const std::filesystem::path& path) {
  BATON_ASSIGN(const Bytes bytes, read_file(path, limits::kMaxBlobBytes));
  return digest_of(bytes);
}

std::optional<FileStamp> stamp_of(const std::filesystem::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  constexpr std::int64_t kNsPerSecond = 1'000'000'000;
  return FileStamp{.size_bytes = static_cast<std::uint64_t>(status.st_size),
                   .inode = status.st_ino,
                   .time_ns = status.st_mtim.tv_sec * kNsPerSecond + status.st_mtim.tv_nsec};
}

void FileTable::add(const FileContent& content) {
  if (files_.size() >= kMaxFiles) files_.clear();
  files_.insert_or_assign(content.path.lexically_normal(), Entry{content.stamp, content.digest});
}

bool FileTable::must_be_read(const std::filesystem::path& path, const BlobRef& recorded) const {
  const std::optional<FileStamp> stamp = stamp_of(path);
  if (!stamp || stamp->size_bytes != recorded.size_bytes) return false;
  const auto known = files_.find(path.lexically_normal());
  return known == files_.end() || known->second.stamp != *stamp;
}

std::optional<bool> FileTable::holds(const std::filesystem::path& path, const BlobRef& recorded) {
  const std::optional<FileStamp> stamp = stamp_of(path);
  std::error_code error;
  if (!stamp)
    return std::filesystem::status(path, error).type() == std::filesystem::file_type::not_found
               ? std::optional(false)
               : std::nullopt;
  if (stamp->size_bytes != recorded.size_bytes) return false;
  const auto known = files_.find(path.lexically_normal());
  if (known == files_.end() || known->second.stamp != *stamp) return std::nullopt;
  if (known->second.digest) return known->second.digest == recorded.digest;
  files_.erase(known);
  return std::nullopt;
}

}  // namespace baton
