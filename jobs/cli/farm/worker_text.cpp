#include "jobs/cli/farm/worker_text.h"

#include <fmt/format.h>

#include "jobs/cli/job_summary.h"
#include "jobs/cli/text.h"

namespace baton {

using nlohmann::ordered_json;

std::string task_time_text(double seconds) {
  return seconds < 10 ? fmt::format("{:.1f}s", seconds) : duration_text(seconds);
}

std::string usual_text(const UsualTime& usual) {
  return usual.count == 0 ? "" : fmt::format(" (usual {})", task_time_text(usual.median_s));
}

void add_usual(const UsualTime& usual, ordered_json& object) {
  if (usual.count == 0) return;
  object["usual"] = {
      {"median", usual.median_s}, {"spread", usual.spread_s}, {"tasks", usual.count}};
}

std::string worker_lines(const WorkerSummary& worker) {
  std::string text = fmt::format("{:<24}  {:<9}  {:>3} threads  {:>3} tasks  seen {} ago  {} on {}",
                                 worker.worker_id, worker_activity_name(worker.activity),
                                 worker.num_threads, worker.tasks.size(),
                                 duration_text(worker.silent_s), worker.renderer, worker.host);
  if (worker.memory_bytes > 0) text += fmt::format("  {} MiB", worker.memory_bytes >> 20);
  for (const TaskInHand& task : worker.tasks)
    text += fmt::format("\n  job {}  {}  for {}{}", task.job.short_hex(), place_text(task.task),
                        task_time_text(task.seconds), usual_text(task.usual));
  for (const BlindSpot& blind : worker.blind)
    text += fmt::format("\n  job {}  gets none of its tasks: does not see {}",
                        blind.job.short_hex(), blind.folder.substr(0, blind.folder.find(": ")));
  return text;
}

ordered_json worker_json(const WorkerSummary& worker) {
  ordered_json tasks = ordered_json::array();
  for (const TaskInHand& task : worker.tasks) {
    ordered_json row = {{"job", task.job.hex()}};
    row.update(place_json(task.task));
    row["seconds"] = task.seconds;
    add_usual(task.usual, row);
    tasks.push_back(std::move(row));
  }
  ordered_json blind = ordered_json::array();
  for (const BlindSpot& spot : worker.blind)
    blind.push_back({{"job", spot.job.hex()}, {"folder", spot.folder}});
  return {{"id", worker.worker_id},
          {"activity", worker_activity_name(worker.activity)},
          {"host", worker.host},
          {"pid", worker.pid},
          {"threads", worker.num_threads},
          {"leases", worker.tasks.size()},
          {"draining", worker.is_draining},
          {"held", worker.is_held},
          {"secondsSilent", worker.silent_s},
          {"memoryBytes", worker.memory_bytes},
          {"build", worker.build},
          {"renderer", worker.renderer},
          {"tasks", std::move(tasks)},
          {"blindTo", std::move(blind)}};
}

std::string absent_line(const AbsentWorker& worker) {
  const bool is_lost = worker.absence == Absence::lost;
  std::string text = fmt::format("{:<24}  {:<11}  {}", worker.worker_id,
                                 absence_name(worker.absence), utc_text(worker.since_ms));
  if (worker.joined_ms > 0)
    text +=
        fmt::format(", after {}",
                    duration_text(static_cast<double>(worker.since_ms - worker.joined_ms) / 1000));
  text += "  " + worker.about;
  return is_lost || worker.reason.empty() ? text : text + "\n  " + worker.reason;
}

ordered_json absent_json(const AbsentWorker& worker) {
  const bool is_lost = worker.absence == Absence::lost;
  ordered_json row = {{"id", worker.worker_id}, {"activity", absence_name(worker.absence)}};
  if (is_lost) row["joined"] = utc_json(worker.joined_ms);
  row[is_lost ? "lost" : "asked"] = utc_json(worker.since_ms);
  row["about"] = worker.about;
  if (!worker.reason.empty()) row["reason"] = worker.reason;
  return row;
}

ordered_json absent_json(const std::vector<AbsentWorker>& workers) {
  ordered_json rows = ordered_json::array();
  for (const AbsentWorker& worker : workers) rows.push_back(absent_json(worker));
  return rows;
}

std::string absent_counts(const JobList& list) {
  std::string text;
  if (!list.turned_away.empty()) text += fmt::format(", {} turned away", list.turned_away.size());
  if (!list.lost.empty()) text += fmt::format(", {} lost in a day", list.lost.size());
  return text;
}

std::string reason_line(const Reason& reason) {
  std::string text = reason.text;
  if (reason.seconds > 0)
    text += fmt::format(" for {}{}", task_time_text(reason.seconds), usual_text(reason.usual));
  if (reason.since_ms > 0) text += fmt::format(", since {}", utc_text(reason.since_ms));
  return text;
}

ordered_json reason_json(const Reason& reason) {
  ordered_json row = {{"kind", reason_kind_name(reason.kind)}, {"text", reason.text}};
  if (!reason.job.empty()) row["job"] = reason.job.hex();
  if (reason.has_task) {
    row.update(place_json(reason.task));
    row.erase("attempt");
  }
  if (!reason.workers.empty()) row["workers"] = reason.workers;
  if (reason.seconds > 0) row["seconds"] = reason.seconds;
  add_usual(reason.usual, row);
  if (reason.since_ms > 0) row["since"] = utc_iso(reason.since_ms);
  if (reason.need_bytes > 0) {
    row["needBytes"] = reason.need_bytes;
    row["freeBytes"] = reason.free_bytes;
  }
  return row;
}

}  // namespace baton
