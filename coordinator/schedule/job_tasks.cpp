#include "coordinator/schedule/job_tasks.h"

#include <algorithm>

#include "common/base/check.h"

namespace baton {

JobTasks::JobTasks(const JobSpec& spec)
    : graph_(spec),
      keep_all_states_(spec.state.keep == StateKeep::all),
      records_(static_cast<std::size_t>(graph_.num_tasks())) {
  progress_.tasks_total = progress_.tasks_open = records_.size();
  for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) {
    record(task).missing_inputs = graph_.num_inputs(graph_.key(task));
    if (record(task).missing_inputs == 0) BATON_CHECK(apply(task, TaskEvent::inputs_done));
  }
}

/// The only place that writes a status: next_status decides, the ready set and the counters follow.
bool JobTasks::apply(TaskIndex task, TaskEvent event) {
  Record& r = record(task);
  const std::optional<TaskStatus> next = next_status(r.status, event);
  if (!next) return false;

  // Leave the old status, enter the new one.
  if (r.status == TaskStatus::ready) ready_.erase(task);
  if (r.status == TaskStatus::leased) --progress_.tasks_leased;
  r.status = *next;
  switch (*next) {
    case TaskStatus::blocked:
      break;
    case TaskStatus::ready:
      ready_.insert(task);
      break;
    case TaskStatus::leased:
      ++progress_.tasks_leased;
      break;
    case TaskStatus::done:
      ++progress_.tasks_done;
      --progress_.tasks_open;
      break;
    case TaskStatus::failed:
      ++progress_.tasks_failed;
      --progress_.tasks_open;
      break;
    case TaskStatus::cancelled:
      --progress_.tasks_open;
      break;
  }
  return true;
}

std::vector<BlobRef> JobTasks::inputs(TaskIndex task) const {
  const TaskKey key = graph_.key(task);
  std::vector<BlobRef> result;
  for (const TaskIndex input : graph_.inputs(key)) {
    const std::vector<BlobRef>& made = outputs(input);
    for (const std::size_t position : graph_.taken_outputs(key, graph_.key(input)))
      result.push_back(made.at(position));
  }
  return result;
}

std::uint32_t JobTasks::grant(TaskIndex task) {
  BATON_CHECK(apply(task, TaskEvent::granted));
  return ++record(task).attempts;
}

void JobTasks::complete(TaskIndex task, const Completion& completion, BlobReferences& blobs) {
  BATON_CHECK(apply(task, TaskEvent::completed));

  // Keep what was made. Images are files of the output folder, not blobs of the store.
  record(task).outputs = completion.outputs;
  progress_.stats.merge(completion.stats);
  for (const FrameStats& frame : completion.frames) {
    progress_.frames[frame.frame].merge(frame.sampling);
  }
  for (const BlobRef& output : completion.outputs) {
    count_output(output);
    for (std::int32_t use = num_uses(task, output); use > 0; --use) blobs.add(output.digest);
  }

  // What this task needed may go; what needed this task comes closer.
  release_inputs(task, blobs);
  for (const TaskIndex dependent : graph_.dependents(completion.task)) {
    if (--record(dependent).missing_inputs == 0) apply(dependent, TaskEvent::inputs_done);
  }
}

void JobTasks::give_back(TaskIndex task) { BATON_CHECK(apply(task, TaskEvent::returned)); }

void JobTasks::give_up(TaskIndex task) {
  BATON_CHECK(apply(task, TaskEvent::exhausted));

  // What needs this task, directly or not, will never be done.
  std::vector<TaskIndex> unreachable = graph_.dependents(graph_.key(task));
  while (!unreachable.empty()) {
    const TaskIndex dependent = unreachable.back();
    unreachable.pop_back();
    if (!apply(dependent, TaskEvent::cancelled)) continue;  // reached before, on another way
    const std::vector<TaskIndex> more = graph_.dependents(graph_.key(dependent));
    unreachable.insert(unreachable.end(), more.begin(), more.end());
  }
}

void JobTasks::cancel_open() {
  for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) apply(task, TaskEvent::cancelled);
}

void JobTasks::add_failure(TaskIndex task, const Failure& failure) {
  failures_[task].push_back({failure.lease, failure.worker});
  ++failures_of_worker_[failure.worker];
  ++progress_.attempts_lost;
}

std::int32_t JobTasks::add_loss(TaskIndex task) {
  ++progress_.attempts_lost;
  return ++record(task).losses;
}

std::int32_t JobTasks::num_failures(TaskIndex task) const {
  const auto found = failures_.find(task);
  return found == failures_.end() ? 0 : static_cast<std::int32_t>(found->second.size());
}

std::int32_t JobTasks::num_failures(TaskIndex task, const std::string& worker) const {
  const auto found = failures_.find(task);
  if (found == failures_.end()) return 0;
  return static_cast<std::int32_t>(
      std::count_if(found->second.begin(), found->second.end(),
                    [&](const FailedAttempt& attempt) { return attempt.worker == worker; }));
}

std::int32_t JobTasks::num_failures(const std::string& worker) const {
  const auto found = failures_of_worker_.find(worker);
  return found == failures_of_worker_.end() ? 0 : found->second;
}

bool JobTasks::has_failed(TaskIndex task, const LeaseId& lease) const {
  const auto found = failures_.find(task);
  if (found == failures_.end()) return false;
  return std::any_of(found->second.begin(), found->second.end(),
                     [&](const FailedAttempt& attempt) { return attempt.lease == lease; });
}

void JobTasks::release_all(BlobReferences& blobs) {
  for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) {
    for (const BlobRef& output : outputs(task)) {
      for (std::int32_t use = num_uses(task, output); use > 0; --use) blobs.release(output.digest);
    }
  }
}

std::vector<Digest> JobTasks::live_blobs() const {
  std::vector<Digest> live;
  for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) {
    for (const BlobRef& output : outputs(task)) {
      if (num_uses(task, output) > 0) live.push_back(output.digest);
    }
  }
  return live;
}

/// How many still need an output of a task that is done: the tasks that take it as input, and
/// whoever keeps it after the job. Completing a dependent makes it one less (release_inputs).
std::int32_t JobTasks::num_uses(TaskIndex task, const BlobRef& output) const {
  if (output.kind == BlobKind::image) return 0;
  std::int32_t uses = 0;
  bool last_state = output.kind == BlobKind::state;
  const TaskKey maker = graph_.key(task);
  for (const TaskIndex dependent : graph_.dependents(maker)) {
    if (!graph_.takes(graph_.key(dependent), maker, output)) continue;
    last_state = false;
    uses += status(dependent) != TaskStatus::done ? 1 : 0;
  }
  const bool kept = last_state || (keep_all_states_ && output.kind == BlobKind::state);
  return uses + (kept ? 1 : 0);
}

void JobTasks::count_output(const BlobRef& output) {
  if (output.kind == BlobKind::image) ++progress_.frames_done;
  if (output.kind == BlobKind::state) {
    progress_.state_bytes += output.size_bytes;
    progress_.state_pixels += graph_.num_pixels(output.tile);
  }
}

void JobTasks::release_inputs(TaskIndex task, BlobReferences& blobs) {
  for (const BlobRef& input : inputs(task)) blobs.release(input.digest);
}

}  // namespace baton
