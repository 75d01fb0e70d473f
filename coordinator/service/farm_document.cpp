#include "coordinator/service/farm_document.h"

#include <fmt/format.h>

#include <filesystem>
#include <list>
#include <map>
#include <mutex>

namespace baton {

namespace fs = std::filesystem;

namespace {

/// What texts say, which does not change: those of the last kMostBytes, and those in use.
class DocumentShelf {
 public:
  SharedDocument find(const Digest& text) {
    const std::lock_guard lock(mutex_);
    const auto found = known_.find(text);
    return found == known_.end() ? nullptr : found->second.lock();
  }
  void add(const Digest& text, const SharedDocument& document, std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    known_[text] = document;
    recent_.push_front({document, bytes});
    recent_bytes_ += bytes;
    while (recent_bytes_ > kMostBytes && recent_.size() > 1) {
      recent_bytes_ -= recent_.back().bytes;
      recent_.pop_back();
    }
    std::erase_if(known_, [](const auto& entry) { return entry.second.expired(); });
  }

 private:
  static constexpr std::size_t kMostBytes = 16u << 20;
  struct Recent {
    SharedDocument document;
    std::size_t bytes = 0;
  };
  std::mutex mutex_;  ///< guards all below
  std::map<Digest, std::weak_ptr<const FarmDocument>> known_;
  std::list<Recent> recent_;  ///< the newest first
  std::size_t recent_bytes_ = 0;
};

DocumentShelf& shelf() {
  static DocumentShelf the_shelf;
  return the_shelf;
}

}  // namespace

Result<ParsedJobDocument> parse_farm_document(std::string_view text) {
  return share_document(text)->parsed;
}

SharedDocument document_at_hand(const Digest& text) { return shelf().find(text); }

SharedDocument share_document(std::string_view text) {
  const Digest digest = digest_of(text);
  if (SharedDocument known = shelf().find(digest)) return known;
  Result<ParsedJobDocument> parsed = parse_job_document(text);
  Status written = parsed ? expect_written(*parsed, text) : Status(parsed.error());
  if (parsed) {
    const fs::path folder = parsed->job.output.directory;
    if (!folder.has_filename()) parsed->job.output.directory = folder.parent_path().string();
  }
  auto shared = std::make_shared<const FarmDocument>(
      FarmDocument{std::move(parsed), std::move(written), text.size()});
  shelf().add(digest, shared, text.size());
  return shared;
}

Result<SharedDocument> journalled_document(Journal& journal, const Digest& job) {
  if (SharedDocument known = document_at_hand(job)) return known;
  BATON_ASSIGN(const std::optional<std::string> text, journal.document(job));
  return share_document(text.value_or(""));
}

std::string resolve_folder(const std::string& folder) {
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(folder, error);
  return (error ? fs::path(folder).lexically_normal() : resolved).string();
}

Result<std::vector<Digest>> jobs_in_folder(Journal& journal, const std::string& folder,
                                           const std::optional<std::string>& name) {
  const std::string wanted = resolve_folder(folder);
  return journal.jobs_in(
      [&](const std::string& known) {
        // One disk may be mounted at two places.
        std::error_code error;
        return resolve_folder(known) == wanted || fs::equivalent(known, wanted, error);
      },
      name);
}

Result<NeededDocuments> documents_in_folder(Journal& journal, const std::string& folder) {
  BATON_ASSIGN(const std::vector<Digest> jobs, jobs_in_folder(journal, folder));
  NeededDocuments needed;
  std::size_t bytes = 0;
  for (const Digest& job : jobs) {
    if (SharedDocument known = document_at_hand(job)) {
      bytes += known->size_bytes;
      needed.at_hand.push_back(std::move(known));
    } else {
      BATON_ASSIGN(std::optional<std::string> text, journal.document(job));
      if (!text) continue;
      bytes += text->size();
      needed.texts.push_back(std::move(*text));
    }
    if (bytes > kMaxDocumentBytes)
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: jobs that write or wrote here have documents of more than {} "
                               "MiB in all: delete some (baton job delete), or choose another "
                               "output.directory",
                               folder, kMaxDocumentBytes >> 20)};
  }
  return needed;
}

}  // namespace baton
