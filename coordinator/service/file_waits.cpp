#include "coordinator/service/file_waits.h"

#include <algorithm>
#include <utility>

namespace baton {

bool FileWaits::join(const ReadFor& reason, const Incoming& message, TimePoint now) {
  const auto found = waits_.find(reason);
  if (found == waits_.end()) return false;
  // Who says it again, as workers do with reports, waits once.
  std::vector<Waiting>& messages = found->second.messages;
  std::erase_if(messages, [&](const Waiting& other) { return other.message.peer == message.peer; });
  if (messages.size() < kMaxWaiting) messages.push_back({message, now});
  return true;
}

bool FileWaits::start(const ReadFor& reason, const std::string& text, std::vector<FileToRead> files,
                      const Incoming& message, TimePoint now) {
  if (!reader_.request(reason, std::move(files))) return false;
  waits_.insert_or_assign(reason, Wait{text, {{message, now}}});
  return true;
}

std::vector<Incoming> FileWaits::take_ready(FileTable& table) {
  std::vector<Incoming> ready;
  for (FilesRead& read : reader_.take()) {
    for (const FileContent& content : read.contents) table.add(content);
    if (const auto wait = waits_.extract(read.reason)) {
      for (Waiting& waiting : wait.mapped().messages) ready.push_back(std::move(waiting.message));
    } else {
      inspected_.push_back(std::move(read));
    }
  }
  return ready;
}

std::vector<FileWaits::Notice> FileWaits::take_notices(TimePoint now) {
  std::vector<Notice> notices;
  for (auto& [reason, wait] : waits_) {
    if (wait.text.empty()) continue;
    std::erase_if(wait.messages, [&](const Waiting& waiting) {
      if (now - waiting.since < kAnswerWithin) return false;
      notices.push_back({waiting.message.peer, wait.text});
      return true;
    });
  }
  return notices;
}

}  // namespace baton
