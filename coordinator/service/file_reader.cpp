#include "coordinator/service/file_reader.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <utility>

namespace baton {

FileReader::FileReader(Disk disk, std::function<void()> wake)
    : disk_(std::move(disk)), wake_(std::move(wake)), thread_([this] { run(); }) {}

FileReader::~FileReader() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

bool FileReader::request(const ReadFor& reason, std::vector<FileToRead> files,
                         std::vector<std::string> documents) {
  {
    const std::lock_guard lock(mutex_);
    if (num_open_ >= kMaxRequests) return false;
    ++num_open_;
    requests_.push_back(
        {{std::make_move_iterator(files.begin()), std::make_move_iterator(files.end())},
         {std::make_move_iterator(documents.begin()), std::make_move_iterator(documents.end())},
         {reason, {}}});
  }
  changed_.notify_one();
  return true;
}

std::vector<FilesRead> FileReader::take() {
  const std::lock_guard lock(mutex_);
  num_open_ -= done_.size();
  return std::exchange(done_, {});
}

void FileReader::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stop_ || !requests_.empty(); });
    if (stop_) return;
    Request request = std::move(requests_.front());
    requests_.pop_front();

    // One file, while others may ask.
    lock.unlock();
    if (!request.files.empty()) {
      request.read.contents.push_back(read(request.files.front()));
      request.files.pop_front();
    } else if (!request.documents.empty()) {
      request.read.documents.push_back(share_document(request.documents.front()));
      request.documents.pop_front();
      // Parsing takes sixty times the text for a moment, which the allocator would keep.
      ::malloc_trim(0);
    }
    lock.lock();

    if (!request.files.empty() || !request.documents.empty()) {
      requests_.push_back(std::move(request));
    } else {
      done_.push_back(std::move(request.read));
      wake_();
    }
  }
}

FileContent FileReader::read(const FileToRead& file) const {
  FileContent content{.path = file.path, .stamp = {}, .digest = {}, .fault = {}};
  const Result<std::optional<FileStamp>> stamp = stamp_of(file.path);
  if (!stamp) {
    content.fault = stamp.error().message;
    return content;
  }
  content.stamp = *stamp;
  if (!content.stamp) return content;
  const std::uint64_t size = content.stamp->size_bytes;
  const bool is_frame = file.is_frame || !file.sizes.empty();
  if (is_frame && size > FileToRead::kMaxStrangeBytes &&
      std::ranges::find(file.sizes, size) == file.sizes.end()) {
    content.fault = fmt::format("{}: {} MiB, which no frame here has: move it away",
                                file.path.string(), size >> 20);
    return content;
  }
  Bytes bytes;
  if (!file.expected.empty() && file.known == content.stamp) {
    content.digest = file.expected.front();
  } else if (Result<Bytes> read = disk_.read(file.path)) {
    bytes = std::move(read).value();
    content.digest = digest_of(bytes);
  } else {
    // It may have gone meanwhile.
    const Result<std::optional<FileStamp>> now = stamp_of(file.path);
    if (now && !*now) {
      content.stamp.reset();
    } else {
      content.fault = read.error().message;
    }
    return content;
  }
  if (file.expected.empty() && !file.is_frame) return content;
  content.is_expected = std::ranges::find(file.expected, *content.digest) != file.expected.end();
  if (!content.is_expected)
    content.writer = disk_.picture_writer(file.path.filename().string(), bytes);
  return content;
}

}  // namespace baton
