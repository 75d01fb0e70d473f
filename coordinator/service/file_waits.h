#pragma once

#include <map>
#include <string>
#include <utility>
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

  /// Of documents that are parsed at once.
  static constexpr std::size_t kParsedAtOnceBytes = 64u << 10;
  /// What was parsed last stays at hand so long: who was told to wait asks again, and may wait for
  /// frames then.
  static constexpr std::chrono::seconds kKeepParsed{5};

  FileWaits(Disk disk, const std::function<void()>& wake)
      : reader_(std::move(disk), wake), parser_({}, wake) {}

  /// Files are being read for this reason: the message waits for them. False: they are not.
  bool join(const ReadFor& reason, const Incoming& message, TimePoint now);
  /// The message waits for files. text: what its sender is told; empty: nothing. False: it does
  /// not, since too many wait.
  bool start(const ReadFor& reason, const std::string& text, std::vector<FileToRead> files,
             const Incoming& message, TimePoint now);
  /// Documents that were not parsed lately are parsed before the message is handled: those of more
  /// than kParsedAtOnceBytes on a thread, for one message of a speaker at a time.
  enum class Parsing { done, waits, no_place };
  Parsing parse(const Incoming& message, NeededDocuments documents, TimePoint now);
  /// Nobody waits for these files but the coordinator. False: there is no place for them now.
  bool inspect(const InspectionOf& reason, std::vector<FileToRead> files) {
    return reader_.request(reason, std::move(files));
  }

  /// The messages that need not wait any more, once `table` has what was read for them.
  std::vector<Incoming> take_ready(FileTable& table, TimePoint now);
  /// The inspections among what take_ready() found; each once.
  std::vector<FilesRead> take_inspected() { return std::exchange(inspected_, {}); }
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
    // Of documents.
    std::string speaker = {};
    std::vector<SharedDocument> at_hand = {};
  };
  std::map<ReadFor, Wait> waits_;
  std::vector<FilesRead> inspected_;
  std::vector<SharedDocument> parsed_;  ///< of one message
  TimePoint parsed_at_{};
  /// Documents do not hold up frames.
  FileReader reader_, parser_;
};

}  // namespace baton
