#include "coordinator/service/file_reader.h"

#include <utility>

namespace baton {

FileReader::FileReader(DigestFile digest_file, std::function<void()> wake)
    : digest_file_(std::move(digest_file)), wake_(std::move(wake)), thread_([this] { run(); }) {}

FileReader::~FileReader() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

bool FileReader::request(const ReadFor& reason, std::vector<std::filesystem::path> files) {
  {
    const std::lock_guard lock(mutex_);
    if (num_open_ >= kMaxRequests) return false;
    ++num_open_;
    requests_.push_back(
        {{std::make_move_iterator(files.begin()), std::make_move_iterator(files.end())},
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
      FileContent content{.path = std::move(request.files.front()), .stamp = {}, .digest = {}};
      request.files.pop_front();
      if (const std::optional<FileStamp> stamp = stamp_of(content.path)) {
        content.stamp = *stamp;
        if (const Result<Digest> digest = digest_file_(content.path)) content.digest = *digest;
        request.read.contents.push_back(std::move(content));
      }
    }
    lock.lock();

    if (!request.files.empty()) {
      requests_.push_back(std::move(request));
    } else {
      done_.push_back(std::move(request.read));
      wake_();
    }
  }
}

}  // namespace baton
