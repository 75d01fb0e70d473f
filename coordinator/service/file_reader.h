#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "common/job/task.h"
#include "coordinator/service/file_table.h"

namespace baton {

/// What files are read for: a job that is submitted or resumed, or a report of a failed attempt.
using ReadFor = std::variant<Digest, LeaseId>;

/// Files of one request that were read.
struct FilesRead {
  ReadFor reason;
  std::vector<FileContent> contents;  ///< without those that were gone by then
};

/// Reads whole files on a thread of its own, since a slow disk may need minutes for them: one file
/// of each request in turn, so that a short request does not wait for a long one. The thread ends
/// with the object, when the file in hand is read; what is left of the requests is forgotten.
class FileReader {
 public:
  using DigestFile = std::function<Result<Digest>(const std::filesystem::path&)>;
  static constexpr std::size_t kMaxRequests = 64;

  /// digest_file: called by the thread. wake: called by the thread when a request is done.
  FileReader(DigestFile digest_file, std::function<void()> wake);
  ~FileReader();
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;

  /// False, and nothing follows: there are kMaxRequests already.
  bool request(const ReadFor& reason, std::vector<std::filesystem::path> files);
  /// The requests that are done, each once.
  std::vector<FilesRead> take();

 private:
  struct Request {
    std::deque<std::filesystem::path> files;
    FilesRead read;
  };
  void run();

  const DigestFile digest_file_;
  const std::function<void()> wake_;
  std::mutex mutex_;  ///< guards all below
  std::condition_variable changed_;
  std::deque<Request> requests_;  ///< but for the one in work
  std::size_t num_open_ = 0;      ///< requests that are not taken
  std::vector<FilesRead> done_;
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all above
};

}  // namespace baton
