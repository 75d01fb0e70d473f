#include "coordinator/service/history.h"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <utility>

#include "common/base/limits.h"
#include "common/base/utc.h"
#include "common/job/text/frame_range.h"

namespace baton {
namespace {

double seconds_since(TimePoint time) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - time).count();
}

FarmEventKind kind_of(JobStatus status) {
  constexpr std::array kKinds{FarmEventKind::job_resumed, FarmEventKind::job_done,
                              FarmEventKind::job_failed, FarmEventKind::job_cancelled,
                              FarmEventKind::job_paused};
  return kKinds.at(static_cast<std::size_t>(status));
}

FarmEventKind kind_of(LeaseEnd end) {
  constexpr std::array kKinds{FarmEventKind::task_done, FarmEventKind::task_failed,
                              FarmEventKind::task_returned, FarmEventKind::task_lost,
                              FarmEventKind::task_revoked};
  return kKinds.at(static_cast<std::size_t>(end));
}

}  // namespace

Status History::read() {
  BATON_ASSIGN(jobs_, IdentityBook::read(journal_));
  BATON_TRY(remember(RecentPast::kinds()));
  BATON_TRY(remember(bit_of(FarmEventKind::task_done)));
  BATON_ASSIGN(const std::vector<FarmEvent> begun, journal_.events_without_end());
  for (FarmEvent event : begun) {
    const bool is_task = event.kind == FarmEventKind::task_granted;
    event.kind = is_task ? FarmEventKind::task_lost : FarmEventKind::worker_lost;
    event.reason = "the coordinator had ended";
    event.seconds = is_task ? static_cast<double>(now_ms() - event.time_ms) / 1000 : 0;
    BATON_TRY(tell(std::move(event)));
  }
  return {};
}

Status History::remember(std::uint64_t kinds) {
  BATON_ASSIGN(const std::vector<FarmEvent> events,
               journal_.events({.count = limits::kMaxEventsTold, .kinds = kinds}));
  for (const FarmEvent& event : events) past_.add(event);
  return {};
}

std::string History::name_of(const Digest& version) const {
  const JobId id = jobs_.of(version).id;
  return id.empty() ? version.short_hex() : id.short_hex();
}

Status History::tell(FarmEvent event) {
  event.time_ms = now_ms();
  // Whom the scheduler gives a task to is nobody's doing.
  if (event.kind != FarmEventKind::task_granted) event.actor = actor_;
  event.reason.resize(std::min<std::size_t>(event.reason.size(), limits::kMaxTextLength));
  past_.add(event);
  return journal_.record_event(event);
}

Status History::submitted(const Digest& document, const JobId& job, const std::string& reason,
                          bool is_told) {
  const bool is_changed = !jobs_.is_newest(document) && !jobs_.versions(job).empty();
  if (!jobs_.is_newest(document)) BATON_TRY(jobs_.add_version(journal_, document, job));
  JobTimes times = jobs_.of(document).times;
  if (times.submitted_ms == 0) times.submitted_ms = now_ms();
  if (times.ended_ms != 0) {
    before_[job] = times;
    times.started_ms = 0;
  }
  times.ended_ms = 0;
  BATON_TRY(jobs_.set_times(journal_, job, times));
  if (!is_told) {
    quiet_.insert(job);
    return {};
  }
  return tell({.kind = is_changed ? FarmEventKind::job_changed : FarmEventKind::job_submitted,
               .job = job,
               .reason = reason});
}

Status History::status_changed(const Digest& version, JobStatus status, const std::string& reason) {
  if (!is_open(status)) etas_.forget(version);
  // A version that has made way for another is not the end of the job.
  if (!jobs_.is_newest(version)) return {};
  const JobIdentity job = jobs_.of(version);
  JobTimes times = job.times;
  times.ended_ms = is_open(status) ? 0 : now_ms();
  // Where nothing had to be rendered, it was done when it was.
  const auto before = before_.find(job.id);
  const bool is_told = quiet_.erase(job.id) == 0 || status != JobStatus::done;
  if (status == JobStatus::done && before != before_.end()) times = before->second;
  if (!is_open(status) && before != before_.end()) before_.erase(before);
  if (status == JobStatus::done && times.started_ms == 0) times.started_ms = times.ended_ms;
  BATON_TRY(jobs_.set_times(journal_, job.id, times));
  const double seconds = times.ended_ms == 0 || times.started_ms == 0
                             ? 0
                             : static_cast<double>(times.ended_ms - times.started_ms) / 1000;
  if (!is_told) return {};
  return tell({.kind = kind_of(status), .job = job.id, .reason = reason, .seconds = seconds});
}

Status History::deleted(const Digest& version) {
  const JobId job = jobs_.of(version).id;
  jobs_.forget(job);
  return tell({.kind = FarmEventKind::job_deleted, .job = job});
}

Status History::locked(const Digest& version, const std::vector<FrameNumber>& frames,
                       bool is_locked, std::int64_t changed_ms, const std::string& why) {
  const JobId job = jobs_.of(version).id;
  BATON_TRY(jobs_.set_locked(journal_, job, frames, is_locked, changed_ms));
  return tell({.kind = is_locked ? FarmEventKind::frames_locked : FarmEventKind::frames_unlocked,
               .job = job,
               .reason = "frames " + format_frames(frames) + why});
}

Status History::requeued(const Digest& version, const std::vector<FrameNumber>& frames) {
  return tell({.kind = FarmEventKind::frames_requeued,
               .job = jobs_.of(version).id,
               .reason = "frames " + format_frames(frames)});
}

Status History::prioritized(const Digest& version, std::int32_t before,
                            const PriorityChange& priority, const std::string& why) {
  const JobId job = jobs_.of(version).id;
  BATON_TRY(jobs_.set_priority(journal_, job, priority));
  return tell({.kind = FarmEventKind::priority_changed,
               .job = job,
               .reason = fmt::format("{}, it was {}{}", priority.wanted, before, why)});
}

Status History::granted(const Scheduler::Job& job, const LeaseId& lease, const std::string& worker,
                        const std::string& reason) {
  const JobIdentity who = jobs_.of(lease.job);
  quiet_.erase(who.id);
  before_.erase(who.id);
  if (who.times.started_ms == 0) {
    JobTimes times = who.times;
    times.started_ms = now_ms();
    BATON_TRY(jobs_.set_times(journal_, who.id, times));
  }
  return tell({.kind = FarmEventKind::task_granted,
               .job = who.id,
               .has_task = true,
               .task = place_of(job, lease.task, lease.attempt),
               .worker = worker,
               .reason = reason});
}

Status History::lease_ended(const Scheduler::Job* job, const TellLeaseEnd& end) {
  FarmEvent event{.kind = kind_of(end.end),
                  .job = jobs_.of(end.lease.job).id,
                  .worker = end.worker,
                  .reason = end.reason,
                  .seconds = seconds_since(end.granted_at)};
  event.has_task = job != nullptr;
  if (job != nullptr) {
    event.task = place_of(*job, end.lease.task, end.lease.attempt);
    etas_.add(*job, end, std::chrono::steady_clock::now());
  }
  return tell(std::move(event));
}

Status History::take_up_times(const Digest& version, const Scheduler::Job& job) {
  BATON_ASSIGN(const std::vector<FarmEvent> done,
               journal_.events({.job = jobs_.of(version).id,
                                .count = limits::kMaxEventsTold,
                                .kinds = bit_of(FarmEventKind::task_done)}));
  etas_.take_up(version, job, done);
  return {};
}

std::string reopened_text(const RecordReopened& tasks) {
  const bool is_one = tasks.tasks.size() == 1;
  return fmt::format("{} finished {} done again, since {}", tasks.tasks.size(),
                     is_one ? "task is" : "tasks are", tasks.why);
}

Status History::reopened(const RecordReopened& tasks) {
  return tell({.kind = FarmEventKind::tasks_reopened,
               .job = jobs_.of(tasks.job).id,
               .reason = reopened_text(tasks)});
}

Status History::happened(FarmEventKind kind, const std::string& worker, const std::string& reason) {
  return tell({.kind = kind, .worker = worker, .reason = reason});
}

Status History::clean_up() {
  const std::chrono::milliseconds age = limits::kMaxEventAge;
  return journal_.forget_events(limits::kMaxEvents, now_ms() - age.count());
}

}  // namespace baton
