#include "coordinator/service/identity_book.h"

namespace baton {

Result<IdentityBook> IdentityBook::read(Journal& journal) {
  IdentityBook book;
  BATON_ASSIGN(const std::vector<JobVersion> versions, journal.versions());
  for (const JobVersion& version : versions) {
    book.documents_[version.document] = version;
    book.jobs_[version.id].versions[version.number] = version.document;
  }
  BATON_ASSIGN(const auto times, journal.times());
  for (const auto& [id, of_job] : times) {
    const auto job = book.jobs_.find(id);
    if (job != book.jobs_.end()) job->second.times = of_job;
  }
  BATON_ASSIGN(const auto locks, journal.locks());
  for (const auto& [id, of_job] : locks) {
    const auto job = book.jobs_.find(id);
    if (job != book.jobs_.end()) job->second.locks = of_job;
  }
  BATON_ASSIGN(const auto priorities, journal.priorities());
  for (const auto& [id, priority] : priorities) {
    const auto job = book.jobs_.find(id);
    if (job != book.jobs_.end()) job->second.priority = priority;
  }
  return book;
}

JobIdentity IdentityBook::of(const Digest& document) const {
  const auto version = documents_.find(document);
  if (version == documents_.end()) return {};
  const JobId& id = version->second.id;
  return {id, version->second.number, jobs_.at(id).times};
}

std::vector<FrameNumber> IdentityBook::locked(const JobId& job) const {
  const std::set<FrameNumber> frames = locks(job).frames;
  return {frames.begin(), frames.end()};
}

JobLocks IdentityBook::locks(const JobId& job) const {
  const auto found = jobs_.find(job);
  return found == jobs_.end() ? JobLocks() : found->second.locks;
}

std::vector<JobId> IdentityBook::with_locks() const {
  std::vector<JobId> ids;
  for (const auto& [id, job] : jobs_) {
    if (!job.locks.frames.empty()) ids.push_back(id);
  }
  return ids;
}

std::int32_t IdentityBook::priority(const JobId& job, std::int32_t written) const {
  const auto found = jobs_.find(job);
  const bool is_set =
      found != jobs_.end() && found->second.priority && found->second.priority->written == written;
  return is_set ? found->second.priority->wanted : written;
}

bool IdentityBook::is_newest(const Digest& document) const {
  const auto version = documents_.find(document);
  if (version == documents_.end()) return false;
  return jobs_.at(version->second.id).versions.rbegin()->second == document;
}

std::vector<Digest> IdentityBook::superseded() const {
  std::vector<Digest> superseded;
  for (const auto& [document, version] : documents_) {
    if (!is_newest(document)) superseded.push_back(document);
  }
  return superseded;
}

std::vector<Digest> IdentityBook::versions(const JobId& job) const {
  std::vector<Digest> documents;
  const auto found = jobs_.find(job);
  if (found == jobs_.end()) return documents;
  for (const auto& [number, document] : found->second.versions) documents.push_back(document);
  return documents;
}

Status IdentityBook::add_version(Journal& journal, const Digest& document, const JobId& job) {
  if (const auto before = documents_.find(document); before != documents_.end()) {
    const auto former = jobs_.find(before->second.id);
    former->second.versions.erase(before->second.number);
    if (former->second.versions.empty() && former->first != job) jobs_.erase(former);
  }
  BATON_ASSIGN(const std::int32_t number, journal.record_version(document, job));
  documents_[document] = {document, job, number};
  jobs_[job].versions[number] = document;
  return {};
}

Status IdentityBook::set_times(Journal& journal, const JobId& job, const JobTimes& times) {
  const auto found = jobs_.find(job);
  if (found == jobs_.end() || found->second.times == times) return {};
  found->second.times = times;
  return journal.record_times(job, times);
}

Status IdentityBook::set_locked(Journal& journal, const JobId& job,
                                const std::vector<FrameNumber>& frames, bool is_locked,
                                std::int64_t changed_ms) {
  const auto found = jobs_.find(job);
  if (found == jobs_.end()) return {};
  JobLocks& locks = found->second.locks;
  locks.changed_ms = changed_ms;
  for (const FrameNumber frame : frames) {
    BATON_TRY(journal.record_lock(job, frame, is_locked, changed_ms));
    if (is_locked) locks.frames.insert(frame);
    if (!is_locked) locks.frames.erase(frame);
  }
  return {};
}

Status IdentityBook::set_priority(Journal& journal, const JobId& job,
                                  const PriorityChange& priority) {
  const auto found = jobs_.find(job);
  if (found == jobs_.end()) return {};
  if (!found->second.priority && priority.wanted == priority.written) return {};
  found->second.priority = priority;
  return journal.record_priority(job, priority);
}

void IdentityBook::forget(const JobId& job) {
  for (const Digest& document : versions(job)) documents_.erase(document);
  jobs_.erase(job);
}

}  // namespace baton
