#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "common/job/task.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/file_table.h"

namespace baton {

/// All frames of a job, which may be called done if they are as recorded.
struct InspectionOf {
  Digest job;
  auto operator<=>(const InspectionOf&) const = default;
};
/// A message that needs documents which nobody has parsed lately; by the first of them.
struct DocumentsOf {
  Digest first;
  auto operator<=>(const DocumentsOf&) const = default;
};
/// What files are read for: a job that is submitted or resumed, a report of a failed attempt, the
/// end of a job, documents.
using ReadFor = std::variant<Digest, LeaseId, InspectionOf, DocumentsOf>;

struct FileToRead {
  std::filesystem::path path;
  /// The digests that a frame may have; of another one it is seen whether it is a picture.
  std::vector<Digest> expected = {};
  /// How it stood when it had the first of these: then it is not read.
  std::optional<FileStamp> known = {};
  /// Whether it is one is seen also where no digest is expected.
  bool is_frame = false;
  /// That a frame may have. One of another size is not read where it is larger than
  /// kMaxStrangeBytes: it may cost more memory than there is.
  std::vector<std::uint64_t> sizes = {};
  static constexpr std::uint64_t kMaxStrangeBytes = 512ull << 20;
};

/// Files of one request, in its order.
struct FilesRead {
  ReadFor reason;
  std::vector<FileContent> contents;
  std::vector<SharedDocument> documents = {};  ///< likewise
};

/// How files are read; a test may have a slow or a broken disk.
struct Disk {
  /// All of a file. Errors: those of read_file.
  std::function<Result<Bytes>(const std::filesystem::path&)> read = read_whole_file;
  /// The job that wrote a whole picture, in hexadecimal digits, as far as it says; nullopt: the
  /// bytes are none. name: of the file, without its folder.
  std::function<std::optional<std::string>(const std::string& name, const Bytes&)> picture_writer =
      [](const auto&, const auto&) { return std::nullopt; };
};

/// Reads whole files, and parses documents, on a thread of its own, since a slow disk may need
/// minutes for them: one
/// of each request in turn, so that a short request does not wait for a long one. The thread ends
/// with the object, when the file in hand is read; what is left of the requests is forgotten.
class FileReader {
 public:
  static constexpr std::size_t kMaxRequests = 64;

  /// disk: used by the thread. wake: called by the thread when a request is done.
  FileReader(Disk disk, std::function<void()> wake);
  ~FileReader();
  FileReader(const FileReader&) = delete;
  FileReader& operator=(const FileReader&) = delete;

  /// Also parses the documents. False, and nothing follows: there are kMaxRequests already.
  bool request(const ReadFor& reason, std::vector<FileToRead> files,
               std::vector<std::string> documents = {});
  /// The requests that are done, each once.
  std::vector<FilesRead> take();

 private:
  struct Request {
    std::deque<FileToRead> files;
    std::deque<std::string> documents;
    FilesRead read;
  };
  void run();
  FileContent read(const FileToRead& file) const;

  const Disk disk_;
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
