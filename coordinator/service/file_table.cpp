#include "coordinator/service/file_table.h"

#include "common/base/files.h"

namespace baton {

Result<Bytes> read_whole_file(const std::filesystem::path& path) {
  return read_file(path, limits::kMaxBlobBytes);
}

FileVerdict judge_locked(const std::filesystem::path& path) {
  const Result<std::optional<FileStamp>> stamp = stamp_of(path);
  if (!stamp) return {FileState::unreadable, stamp.error().message};
  return {*stamp ? FileState::right : FileState::absent};
}

FileVerdict judge_content(const FileContent* content, const BlobRef& recorded) {
  if (content == nullptr) return {FileState::unknown};
  if (!content->fault.empty()) return {FileState::unreadable, content->fault};
  if (!content->stamp) return {FileState::absent};
  if (!content->digest) return {FileState::unknown};
  if (content->digest == recorded.digest) return {FileState::right};
  if (content->is_expected) return {FileState::unknown};  // by somebody else
  if (!content->writer) return {FileState::damaged};
  return {FileState::strange, {}, *content->digest, *content->writer};
}

void FileTable::add(const FileContent& content) {
  if (files_.size() >= kMaxFiles) files_.clear();
  const std::filesystem::path path = content.path.lexically_normal();
  forget(path);
  if (!content.stamp) return;  // what is not there needs no reading
  if (!content.fault.empty()) unread_.insert(path);
  files_.emplace(path, content);
}

FileVerdict FileTable::judge(const std::filesystem::path& path, const BlobRef& recorded) const {
  const Result<std::optional<FileStamp>> stamp = stamp_of(path);
  if (!stamp) return {FileState::unreadable, stamp.error().message};
  if (!*stamp) return {FileState::absent};
  if (recorded.kind != BlobKind::image && (*stamp)->size_bytes != recorded.size_bytes)
    return {FileState::damaged};
  const auto known = files_.find(path.lexically_normal());
  if (known == files_.end() || known->second.stamp != *stamp) return {FileState::unknown};
  return judge_content(&known->second, recorded);
}

std::optional<FileStamp> FileTable::stamp_with(const std::filesystem::path& path,
                                               const Digest& digest) const {
  const auto known = files_.find(path.lexically_normal());
  if (known == files_.end() || known->second.digest != digest) return std::nullopt;
  return known->second.stamp;
}

void FileTable::forget(const std::filesystem::path& path) {
  const std::filesystem::path normal = path.lexically_normal();
  files_.erase(normal);
  unread_.erase(normal);
}

void FileTable::forget_unread() {
  for (const std::filesystem::path& path : unread_) files_.erase(path);
  unread_.clear();
}

}  // namespace baton
