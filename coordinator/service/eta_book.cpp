#include "coordinator/service/eta_book.h"

#include <algorithm>

namespace baton {
namespace {

constexpr std::chrono::seconds kLeastInterval{2};
/// A forecast takes this share of the coordinator's time at most.
constexpr int kShareOfTime = 20;

/// Whether the worker gets tasks of the job.
bool may_work(const Scheduler& scheduler, const Digest& version, const std::string& worker,
              TimePoint now) {
  const Scheduler::Job& job = *scheduler.find_job(version);
  const LeaseBook& leases = scheduler.leases();
  return leases.knows(worker) && leases.renders_as(worker, renderer_of(version, job, leases)) &&
         !rests(job.crew(leases, now), worker);
}

double seconds_of(TimePoint::duration time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

void EtaBook::add(const Scheduler::Job& job, const TellLeaseEnd& end, TimePoint now) {
  if (end.end == LeaseEnd::done)
    note(end.lease.job, job.tasks.graph(), end.lease.task, end.worker,
         seconds_of(now - end.granted_at));
}

void EtaBook::take_up(const Digest& version, const Scheduler::Job& job,
                      const std::vector<FarmEvent>& done) {
  // Places do not say which sweep they are of.
  if (job.spec.quality.sweeps > 1) return;
  const JobGraph& graph = job.tasks.graph();
  std::map<FrameNumber, FrameIndex> frames;
  for (FrameIndex frame; frame.index() < job.spec.frames.size(); ++frame)
    frames[job.spec.frames[frame.index()]] = frame;
  for (const FarmEvent& event : done) {
    const auto first = frames.find(event.task.first);
    if (!event.has_task || first == frames.end()) continue;
    const Step step = graph.timeline().step_of(first->second, Sweep(0));
    TaskKey task = assemble_task(first->second);
    if (event.task.kind == TaskKind::second_pass) task = second_pass_task(step, event.task.tile);
    if (event.task.kind == TaskKind::render)
      task = render_task(graph.timeline().run_of(step), event.task.tile);
    if (graph.find(task)) note(version, graph, task, event.worker, event.seconds);
  }
}

void EtaBook::note(const Digest& version, const JobGraph& graph, const TaskKey& task,
                   const std::string& worker, double seconds) {
  const bool is_workers_first = begun_.emplace(version, worker).second;
  const bool is_render = task.kind == TaskKind::render;
  times_[version].add({.kind = task.kind,
                       .tile = task.kind == TaskKind::assemble ? 0 : task.tile,
                       .steps = steps_of(graph, task),
                       .seconds = seconds,
                       .is_first = is_workers_first || (is_render && task.run() == Run(0))});
}

void EtaBook::forget(const Digest& version) {
  times_.erase(version);
  std::erase_if(begun_, [&](const auto& entry) { return entry.first == version; });
}

EtaBook::Found EtaBook::find(const Scheduler& scheduler, const Slots& slots, TimePoint now) const {
  static const TaskTimes kNone;
  std::vector<Digest> versions;
  std::vector<ForecastJob> jobs;
  std::set<std::string> useful;
  for (const Digest& version : scheduler.in_turn()) {
    const Scheduler::Job& job = *scheduler.find_job(version);
    if (!job.waits.empty() || scheduler.lacks_renderer(version)) continue;
    // One that is not begun before others have ended is in nobody's way.
    const std::set<TaskIndex>& ready = job.tasks.book().ready();
    if (job.begun_runs == Run(0) && !ready.empty() &&
        scheduler.room_for(job, *ready.begin(), Room::enough) == Room::beside)
      continue;
    const auto times = times_.find(version);
    versions.push_back(version);
    jobs.push_back(
        {job.tasks.graph(), job.tasks.book(), times == times_.end() ? kNone : times->second});
    jobs.back().most_at_once = 0;
    for (const auto& [worker, count] : slots) {
      if (!may_work(scheduler, version, worker, now)) continue;
      jobs.back().most_at_once += count;
      useful.insert(worker);
    }
    for (const TaskIndex task : scheduler.leases().of_job(version))
      jobs.back().in_work.emplace_back(
          task, seconds_of(now - scheduler.leases().at({version, task}).granted_at));
  }
  int num_slots = 0;
  for (const auto& [worker, count] : slots) num_slots += useful.contains(worker) ? count : 0;
  const std::vector<Eta> etas = forecast(jobs, num_slots);
  const auto took = std::chrono::steady_clock::now() - now;
  Found found{{}, now, now + std::max<TimePoint::duration>(kLeastInterval, kShareOfTime * took)};
  for (std::size_t j = 0; j < jobs.size(); ++j) found.etas[versions[j]] = etas[j];
  return found;
}

Eta EtaBook::of(const Digest& version, const Scheduler& scheduler, const Slots& slots,
                TimePoint now) const {
  if (now >= found_.again) found_ = find(scheduler, slots, now);
  const auto found = found_.etas.find(version);
  if (found == found_.etas.end() || !found->second.is_known()) return {};
  const double passed = seconds_of(now - found_.at);
  const auto left = [&](double seconds) { return std::max(seconds - passed, 0.0); };
  const Eta& eta = found->second;
  return {left(eta.early_s), left(eta.likely_s), std::max(left(eta.late_s), 1e-3)};
}

}  // namespace baton
