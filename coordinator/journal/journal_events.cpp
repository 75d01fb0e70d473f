#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>

#include "common/base/legible.h"
#include "coordinator/journal/journal.h"

namespace baton {
namespace {

/// Whether it ends what a grant or an arrival began.
bool is_end(FarmEventKind kind) {
  return (kind >= FarmEventKind::task_done && kind <= FarmEventKind::task_revoked) ||
         kind == FarmEventKind::worker_left || kind == FarmEventKind::worker_lost;
}

}  // namespace

Result<std::vector<JobVersion>> Journal::versions() {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT document, id, number FROM versions "
                                                     "ORDER BY id, number"));
  std::vector<JobVersion> versions;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return versions;
    const std::optional<Digest> document = Digest::from_hex(query.text(0));
    const std::optional<JobId> id = JobId::from_hex(query.text(1));
    if (!document || !id) {
      return Error{ErrorKind::corrupt, fmt::format("{}: versions: no version: '{}' of '{}'",
                                                   database_.name(), query.text(0), query.text(1))};
    }
    versions.push_back({*document, *id, static_cast<std::int32_t>(query.integer(2))});
  }
}

Result<std::map<JobId, JobTimes>> Journal::times() {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT id, submitted_ms, started_ms, ended_ms FROM identities"));
  std::map<JobId, JobTimes> times;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return times;
    if (const std::optional<JobId> id = JobId::from_hex(query.text(0)))
      times[*id] = {query.integer(1), query.integer(2), query.integer(3)};
  }
}

Result<std::int32_t> Journal::record_version(const Digest& document, const JobId& id) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT max(number) FROM versions WHERE id = ?"));
  BATON_ASSIGN(const bool row, query.bind(id.hex()).step());
  const std::int64_t number = row ? query.integer(0) + 1 : 1;
  BATON_TRY(change("INSERT OR REPLACE INTO versions (document, id, number) VALUES (?, ?, ?)",
                   document, id.hex(), number));
  BATON_TRY(change("INSERT OR IGNORE INTO identities (id) VALUES (?)", id.hex()));
  return static_cast<std::int32_t>(number);
}

Status Journal::record_times(const JobId& id, const JobTimes& times) {
  return change("UPDATE identities SET submitted_ms = ?, started_ms = ?, ended_ms = ? WHERE id = ?",
                times.submitted_ms, times.started_ms, times.ended_ms, id.hex());
}

Result<std::map<JobId, JobLocks>> Journal::locks() {
  std::map<JobId, JobLocks> locks;
  BATON_ASSIGN(SqlStatement frames, database_.prepare("SELECT id, frame FROM locked_frames"));
  for (bool row = true; row;) {
    BATON_ASSIGN(row, frames.step());
    if (const auto id = row ? JobId::from_hex(frames.text(0)) : std::nullopt)
      locks[*id].frames.insert(FrameNumber(static_cast<std::int32_t>(frames.integer(1))));
  }
  BATON_ASSIGN(SqlStatement times, database_.prepare("SELECT id, changed_ms FROM lock_times"));
  for (bool row = true; row;) {
    BATON_ASSIGN(row, times.step());
    if (const auto id = row ? JobId::from_hex(times.text(0)) : std::nullopt)
      locks[*id].changed_ms = times.integer(1);
  }
  return locks;
}

Status Journal::record_lock(const JobId& id, FrameNumber frame, bool is_locked,
                            std::int64_t changed_ms) {
  BATON_TRY(change("INSERT OR REPLACE INTO lock_times (id, changed_ms) VALUES (?, ?)", id.hex(),
                   changed_ms));
  return change(is_locked ? "INSERT OR IGNORE INTO locked_frames (id, frame) VALUES (?, ?)"
                          : "DELETE FROM locked_frames WHERE id = ? AND frame = ?",
                id.hex(), std::int64_t{frame.value()});
}

Result<std::map<JobId, PriorityChange>> Journal::priorities() {
  BATON_ASSIGN(SqlStatement query, database_.prepare("SELECT id, written, wanted FROM priorities"));
  std::map<JobId, PriorityChange> priorities;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return priorities;
    if (const std::optional<JobId> id = JobId::from_hex(query.text(0)))
      priorities[*id] = {static_cast<std::int32_t>(query.integer(1)),
                         static_cast<std::int32_t>(query.integer(2))};
  }
}

Status Journal::record_priority(const JobId& id, const PriorityChange& priority) {
  return change("INSERT OR REPLACE INTO priorities (id, written, wanted) VALUES (?, ?, ?)",
                id.hex(), std::int64_t{priority.written}, std::int64_t{priority.wanted});
}

Result<std::map<std::string, Digest>> Journal::given_up(const JobId& id) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT file, digest FROM pictures_given_up WHERE id = ?"));
  query.bind(id.hex());
  std::map<std::string, Digest> given_up;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return given_up;
    if (const std::optional<Digest> digest = Digest::from_hex(query.text(1)))
      given_up[query.text(0)] = *digest;
  }
}

Status Journal::record_given_up(const JobId& id, const std::string& file,
                                const std::optional<Digest>& picture) {
  if (!picture)
    return change("DELETE FROM pictures_given_up WHERE id = ? AND file = ?", id.hex(), file);
  return change("INSERT OR REPLACE INTO pictures_given_up (id, file, digest) VALUES (?, ?, ?)",
                id.hex(), file, *picture);
}

Result<JobGrowth> Journal::growth(const JobId& id) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT since_ms, sweeps, said FROM growth WHERE id = ?"));
  BATON_ASSIGN(const bool row, query.bind(id.hex()).step());
  JobGrowth growth;
  if (!row) return growth;
  growth.since_ms = query.integer(0);
  growth.first_sweeps = static_cast<std::int32_t>(query.integer(1));
  std::istringstream lines(query.text(2));
  for (std::string line; std::getline(lines, line);) growth.said.push_back(std::move(line));
  return growth;
}

Status Journal::record_growth(const JobId& id, const JobGrowth& growth) {
  if (growth.since_ms == 0) return change("DELETE FROM growth WHERE id = ?", id.hex());
  return change("INSERT OR REPLACE INTO growth (id, since_ms, sweeps, said) VALUES (?, ?, ?, ?)",
                id.hex(), growth.since_ms, std::int64_t{growth.first_sweeps},
                fmt::format("{}", fmt::join(growth.said, "\n")));
}

Status Journal::record_event(const FarmEvent& event) {
  const std::string job = event.job.empty() ? std::string() : event.job.hex();
  if (!event.has_task) {
    return change(
        "INSERT INTO events (time_ms, kind, actor, job, worker, reason, seconds) "
        "VALUES (?, ?, ?, ?, ?, ?, ?)",
        event.time_ms, event.kind, event.actor, job, event.worker, event.reason, event.seconds);
  }
  const TaskPlace& task = event.task;
  return change(
      "INSERT INTO events (time_ms, kind, actor, job, worker, reason, seconds, task, first_frame, "
      "last_frame, tile, attempt) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      event.time_ms, event.kind, event.actor, job, event.worker, event.reason, event.seconds,
      task.kind, std::int64_t{task.first.value()}, std::int64_t{task.last.value()},
      std::int64_t{task.tile}, std::int64_t{task.attempt});
}

Result<std::vector<FarmEvent>> Journal::events(const EventQuery& wanted) {
  const std::string columns =
      "SELECT sequence, time_ms, kind, actor, job, worker, reason, seconds, task, first_frame, "
      "last_frame, tile, attempt FROM events WHERE ";
  const std::string of_job = wanted.job.empty() ? "?1 = ?1" : "job = ?1";
  const std::string order = wanted.is_newest ? "DESC" : "ASC";
  BATON_ASSIGN(SqlStatement query,
               database_.prepare(fmt::format(
                   "SELECT * FROM ({} {} AND sequence > ?2 AND time_ms >= ?3 AND "
                   "(?5 = 0 OR (?5 >> kind) & 1) ORDER BY sequence {} LIMIT ?4) ORDER BY sequence",
                   columns, of_job, order)));
  query.bind(wanted.job.hex())
      .bind(wanted.after_sequence)
      .bind(wanted.since_ms)
      .bind(std::int64_t{wanted.count})
      .bind(static_cast<std::int64_t>(wanted.kinds));
  std::vector<FarmEvent> events;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return events;
    FarmEvent event{.sequence = query.integer(0), .time_ms = query.integer(1)};
    const std::int64_t kind = query.integer(2);
    // A later program may tell more kinds of events than this one knows.
    if (kind < 0 || kind > static_cast<std::int64_t>(last_of(event.kind))) continue;
    event.kind = static_cast<FarmEventKind>(kind);
    event.actor = legible_line(query.text(3));
    event.job = JobId::from_hex(query.text(4)).value_or(JobId());
    event.worker = legible_line(query.text(5));
    // What is told of a worker is its name and host, a line.
    event.reason = event.job.empty() ? legible_line(query.text(6)) : query.text(6);
    event.seconds = query.real(7);
    event.has_task = !query.is_null(8);
    const std::int64_t task = query.integer(8);
    if (task < 0 || task > static_cast<std::int64_t>(last_of(TaskKind{}))) continue;
    if (event.has_task) {
      event.task = {.kind = static_cast<TaskKind>(task),
                    .first = FrameNumber(static_cast<std::int32_t>(query.integer(9))),
                    .last = FrameNumber(static_cast<std::int32_t>(query.integer(10))),
                    .tile = static_cast<std::int32_t>(query.integer(11)),
                    .attempt = static_cast<std::uint32_t>(query.integer(12))};
    }
    events.push_back(std::move(event));
  }
}

Result<std::vector<FarmEvent>> Journal::events_without_end() {
  BATON_ASSIGN(SqlStatement start,
               database_.prepare("SELECT max(sequence) FROM events WHERE kind = ?"));
  BATON_ASSIGN(const bool row, start.bind(FarmEventKind::coordinator_started).step());
  EventQuery next{.after_sequence = row ? start.integer(0) : 0, .count = 10000, .is_newest = false};
  std::map<std::string, FarmEvent> begun;
  while (true) {
    BATON_ASSIGN(const std::vector<FarmEvent> events, this->events(next));
    for (const FarmEvent& event : events) {
      const TaskPlace& task = event.task;
      const std::string key =
          event.has_task ? fmt::format("{} {} {} {} {} {} {}", event.job.hex(),
                                       static_cast<int>(task.kind), task.first.value(),
                                       task.last.value(), task.tile, task.attempt, event.worker)
                         : event.worker;
      if (event.kind == FarmEventKind::task_granted || event.kind == FarmEventKind::worker_joined)
        begun[key] = event;
      if (is_end(event.kind)) begun.erase(key);
    }
    if (events.empty()) break;
    next.after_sequence = events.back().sequence;
  }
  std::vector<FarmEvent> open;
  for (auto& [key, event] : begun) open.push_back(std::move(event));
  std::ranges::sort(open, {}, &FarmEvent::sequence);
  return open;
}

Result<std::map<FarmEventKind, EventSum>> Journal::event_sums(const JobId& job) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT kind, count, seconds FROM event_sums WHERE job = ?"));
  query.bind(job.hex());
  std::map<FarmEventKind, EventSum> sums;
  while (true) {
    BATON_ASSIGN(const bool row, query.step());
    if (!row) return sums;
    sums[static_cast<FarmEventKind>(query.integer(0))] = {query.integer(1), query.real(2)};
  }
}

Status Journal::forget_events(std::int64_t most, std::int64_t until_ms) {
  BATON_ASSIGN(SqlStatement query,
               database_.prepare("SELECT max(sequence) FROM events WHERE (sequence <= "
                                 "(SELECT max(sequence) FROM events) - ?1 OR time_ms < ?2) AND "
                                 "sequence < (SELECT max(sequence) FROM events)"));
  BATON_ASSIGN(const bool row, query.bind(most).bind(until_ms).step());
  const std::int64_t last = row ? query.integer(0) : 0;
  if (last == 0) return {};
  BATON_TRY(
      change("INSERT INTO event_sums (job, kind, count, seconds) "
             "SELECT job, kind, count(*), sum(seconds) FROM events WHERE sequence <= ? "
             "GROUP BY job, kind ON CONFLICT (job, kind) DO UPDATE SET "
             "count = count + excluded.count, seconds = seconds + excluded.seconds",
             last));
  return change("DELETE FROM events WHERE sequence <= ?", last);
}

}  // namespace baton
