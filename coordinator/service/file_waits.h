#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/protocol/router.h"
#include "coordinator/schedule/events.h"
#include "coordinator/service/file_reader.h"

namespace baton {

/// Messages that cannot be handled before files are read. Each waits here without any effect, and
/// is handled again, from its beginning, when what is read is known (FileTable). A client that
/// waits is answered meanwhile that it is not done; it asks again, and its message waits once more.
class FileWaits {
 public:
  /// A client hears so long nothing.
  static constexpr std::chrono::milliseconds kAnswerWithin{1000};
  static constexpr std::size_t kMaxWaiting = 64;  ///< messages for one reason

  FileWaits(FileReader::DigestFile digest_file, std::function<void()> wake)
      : reader_(std::move(digest_file), std::move(wake)) {}

  /// Files are being read for this reason: the message waits for them. False: they are not.
  bool join(const ReadFor& reason, const Incoming& message, TimePoint now);
  /// The message waits for files. text: what its sender is told; empty: nothing. False: it does
  /// not, since too many wait.
  bool start(const ReadFor& reason, const std::string& text,
             std::vector<std::filesystem::path> files, const Incoming& message, TimePoint now);

  /// The messages that need not wait any more, once `table` has what was read for them.
  std::vector<Incoming> take_ready(FileTable& table);
  /// Clients that are to be answered that their message waits; it is forgotten, but files are read.
  struct Notice {
    PeerId peer;
    std::string text;
  };
  std::vector<Notice> take_notices(TimePoint now);

 private:
  struct Waiting {
    Incoming message;
    TimePoint since;
  };
  struct Wait {
    std::string text;
    std::vector<Waiting> messages;
  };
  std::map<ReadFor, Wait> waits_;
  FileReader reader_;
};

}  // namespace baton
