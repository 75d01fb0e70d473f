#include "worker/run/job_cache.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/base/limits.h"
#include "common/job/job_json.h"

namespace baton {

Result<LoadedJobPtr> load_job_document(const Digest& digest, const std::string& document,
                                       AssetShelf& shelf) {
  BATON_ASSIGN(ParsedJobDocument parsed, parse_job_document(document));
  if (parsed.digest != digest) {
    return Error{ErrorKind::corrupt,
                 fmt::format("job document {}: digest is {}", digest.hex(), parsed.digest.hex())};
  }
  BATON_TRY(verify_assets(parsed.assets));
  BATON_ASSIGN(const auto assets, shelf.get(parsed.job, parsed.assets));
  BATON_ASSIGN(auto context, make_render_context(parsed.job, parsed.picture, assets));
  return LoadedJobPtr(std::make_shared<LoadedJob>(LoadedJob{.job = std::move(parsed.job),
                                                            .digest = digest,
                                                            .picture = parsed.picture,
                                                            .context = std::move(context)}));
}

void JobEntry::provide(const std::string& document) {
  const std::lock_guard lock(mutex_);
  if (document_) return;
  document_ = document;
  changed_.notify_all();
}

bool JobEntry::has_document() const {
  const std::lock_guard lock(mutex_);
  return document_.has_value();
}

bool JobEntry::failed() const {
  const std::lock_guard lock(mutex_);
  return result_ && !result_->ok();
}

LoadedJobPtr JobEntry::loaded() const {
  const std::lock_guard lock(mutex_);
  return result_ && result_->ok() ? result_->value() : nullptr;
}

Result<LoadedJobPtr> JobEntry::load(std::stop_token stop) {
  // Wait until there is something to do or to return.
  std::unique_lock lock(mutex_);
  const bool ready =
      changed_.wait(lock, stop, [this] { return result_ || (document_ && !loading_); });
  if (!ready) return Error{ErrorKind::cancelled, "stopped while waiting for the job to load"};
  if (result_) return *result_;

  // Load without the lock: it may take long, and others only wait.
  loading_ = true;
  lock.unlock();
  Result<LoadedJobPtr> result = loader_(digest_, *document_);

  lock.lock();
  if (!result && result.error().kind == ErrorKind::io) {
    spdlog::warn("waits {} s: {}", file_patience_.count() / 1000, result.error().message);
    changed_.wait_for(lock, stop, file_patience_, [] { return false; });
    lock.unlock();
    if (!stop.stop_requested()) result = loader_(digest_, *document_);
    lock.lock();
  }
  result_ = result;
  changed_.notify_all();
  return result;
}

std::vector<LoadedJobPtr> JobCache::loaded() const {
  std::vector<LoadedJobPtr> jobs;
  for (const std::shared_ptr<JobEntry>& entry : entries_) {
    if (LoadedJobPtr job = entry->loaded()) jobs.push_back(std::move(job));
  }
  return jobs;
}

std::shared_ptr<JobEntry> JobCache::entry(const Digest& digest) {
  // Move the job to the front.
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const auto& entry) { return entry->digest() == digest; });
  if (found != entries_.end()) {
    if (!(*found)->failed()) {
      entries_.splice(entries_.begin(), entries_, found);
      return entries_.front();
    }
    entries_.erase(found);
  }

  // Make room. A job that tasks still hold stays: a document that arrives for it must find it.
  for (auto oldest = entries_.end();
       entries_.size() >= limits::kMaxCachedJobs && oldest != entries_.begin();) {
    --oldest;
    if (oldest->use_count() == 1) oldest = entries_.erase(oldest);
  }
  entries_.push_front(std::make_shared<JobEntry>(digest, loader_, file_patience_));
  return entries_.front();
}

}  // namespace baton
