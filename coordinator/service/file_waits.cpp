#include "coordinator/service/file_waits.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
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

FileWaits::Parsing FileWaits::parse(const Incoming& message, NeededDocuments documents,
                                    TimePoint now) {
  std::erase_if(documents.texts, [&](const std::string& text) {
    SharedDocument known = document_at_hand(digest_of(text));
    const bool is_known = known != nullptr;
    if (is_known) documents.at_hand.push_back(std::move(known));
    return is_known;
  });
  std::size_t bytes = 0;
  for (const std::string& text : documents.texts) bytes += text.size();
  if (bytes <= kParsedAtOnceBytes) return Parsing::done;
  const DocumentsOf reason{digest_of(documents.texts.front())};
  if (join(reason, message, now)) return Parsing::waits;
  const bool is_busy = std::ranges::any_of(waits_, [&](const auto& wait) {
    return std::holds_alternative<DocumentsOf>(wait.first) &&
           wait.second.speaker == message.speaker.name;
  });
  if (is_busy || !parser_.request(reason, {}, std::move(documents.texts))) return Parsing::no_place;
  waits_.insert_or_assign(reason, Wait{fmt::format("reading documents of {} KiB", bytes >> 10),
                                       {{message, now}},
                                       message.speaker.name,
                                       std::move(documents.at_hand)});
  return Parsing::waits;
}

std::vector<Incoming> FileWaits::take_ready(FileTable& table, TimePoint now) {
  std::vector<Incoming> ready;
  std::vector<FilesRead> done = reader_.take(), parsed = parser_.take();
  if (!parsed.empty() || now - parsed_at_ > kKeepParsed) parsed_.clear();
  if (!parsed.empty()) parsed_at_ = now;
  std::ranges::move(parsed, std::back_inserter(done));
  for (FilesRead& read : done) {
    std::ranges::move(read.documents, std::back_inserter(parsed_));
    for (const FileContent& content : read.contents) table.add(content);
    if (auto wait = waits_.extract(read.reason)) {
      std::ranges::move(wait.mapped().at_hand, std::back_inserter(parsed_));
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
