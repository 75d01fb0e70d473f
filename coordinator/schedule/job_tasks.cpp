#include "coordinator/schedule/job_tasks.h"

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/base/limits.h"

namespace baton {

JobTasks::JobTasks(const JobSpec& spec)
    : graph_(spec),
      checkpoints_(graph_),
      keep_all_states_(spec.state.keep == StateKeep::all),
      keep_films_(spec.quality.refinable),
      records_(static_cast<std::size_t>(graph_.num_tasks())),
      open_renders_(static_cast<std::size_t>(graph_.num_runs()), graph_.num_tiles()) {
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
  const bool was_open = is_open(r.status);
  if (r.status == TaskStatus::ready) ready_.erase(task);
  if (r.status == TaskStatus::leased) --progress_.tasks_leased;
  if (r.status == TaskStatus::done) {
    --progress_.tasks_done;
    ++progress_.tasks_open;
  }
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
  if (task < graph_.num_frames()) {  // its assembly
    TaskIndex first = std::min(first_open_frame_.value(), task);
    while (first < graph_.num_frames() && !is_open(status(first))) ++first;
    first_open_frame_ = FrameIndex(first);
  }
  if (was_open != is_open(r.status)) count_run(task, is_open(r.status));
  return true;
}

/// A task was opened or closed.
void JobTasks::count_run(TaskIndex task, bool opened) {
  const TaskKey key = graph_.key(task);
  if (key.kind != TaskKind::render) return;
  open_renders_[key.run().index()] += opened ? 1 : -1;
  first_open_run_ = std::min(first_open_run_, key.run());
  while (first_open_run_ < Run(graph_.num_runs()) && num_open_renders(first_open_run_) == 0)
    ++first_open_run_;
}

std::vector<BlobRef> JobTasks::inputs(TaskIndex task) const {
  if (const auto cut = cuts_.find(task); cut != cuts_.end()) return cut->second;
  BATON_CHECK(has_inputs(task));
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

void JobTasks::complete(TaskIndex task, const Completion& completion, const std::string& worker,
                        bool is_shared, BlobReferences& blobs) {
  const auto next = static_cast<std::uint16_t>(makers_.size());
  const bool full = makers_.size() > limits::kMaxWorkers;
  const auto [maker, is_new] = full ? std::pair{maker_numbers_.find(worker), false}
                                    : maker_numbers_.try_emplace(worker, next);
  if (is_new) makers_.push_back(worker);
  record(task).maker = maker != maker_numbers_.end() ? maker->second : std::uint16_t{0};
  if (!former_outputs_.contains(task)) {
    progress_.stats.merge(completion.stats);
    const bool is_frame = completion.task.kind == TaskKind::assemble;
    for (const FrameStats& stats : completion.frames)
      add_stats(is_frame ? stats.frame() : graph_.timeline().frame_of(stats.step()), stats);
  }
  force_done(task, completion.outputs);
  record(task).is_shared = is_shared;
  add_outputs(task, blobs);

  // What this task needed may go; what needed this task comes closer.
  if (!drop_cut(task, blobs)) release_inputs(task, blobs);
  if (completion.task.kind == TaskKind::render)
    let_go(checkpoints_.complete(completion.task), blobs);
  for (const TaskIndex dependent : graph_.dependents(completion.task)) {
    if (--record(dependent).missing_inputs == 0) apply(dependent, TaskEvent::inputs_done);
  }
}

/// Adds to what a frame counts over its tiles and sweeps.
void JobTasks::add_stats(FrameIndex frame, const FrameStats& stats) {
  progress_.frames[frame].merge(stats);
}

Step JobTasks::first_open_step() const {
  const Timeline& timeline = graph_.timeline();
  const Step step = timeline.last_step_of(first_open_frame_);
  if (first_open_run_ >= Run(graph_.num_runs())) return step;
  return std::min(step, timeline.steps_of(first_open_run_).first);
}

/// Brings a task to done, along the legal way, and keeps what it made.
void JobTasks::force_done(TaskIndex task, const std::vector<BlobRef>& outputs) {
  apply(task, TaskEvent::inputs_done);
  apply(task, TaskEvent::granted);
  BATON_CHECK(apply(task, TaskEvent::completed));
  record(task).outputs = outputs;
  record(task).films_let_go = false;
  for (const BlobRef& output : outputs) count_output(output, true);
}

std::vector<TaskIndex> JobTasks::restore(const Completions& completions,
                                         const std::vector<BlobRef>& gone, BlobReferences& blobs,
                                         const JobPlan& plan) {
  // First all statuses: who needs what follows from them.
  std::vector<TaskIndex> done, hollow;
  std::vector<BlobRef> outputs;
  for (const Completions::Task& recorded : completions.tasks) {
    const std::optional<TaskIndex> task = graph_.find(recorded.task);
    if (!task || status(*task) == TaskStatus::done) continue;
    outputs = recorded.outputs;
    const bool is_hollow =
        recorded.task.kind != TaskKind::assemble &&
        (outputs.empty() || !graph_.check_outputs(recorded.task, outputs, JobGraph::Extent::state));
    if (!is_hollow && graph_.check_outputs(recorded.task, outputs)) continue;
    if (is_hollow) hollow.push_back(*task);
    force_done(*task, outputs);
    done.push_back(*task);
  }
  progress_.stats = completions.stats;
  for (const auto& [step, stats] : completions.steps)
    add_stats(graph_.timeline().frame_of(step), stats);
  for (const auto& [frame, stats] : completions.frames) add_stats(frame, stats);
  for (const TaskIndex task : done) {
    for (const TaskIndex dependent : graph_.dependents(graph_.key(task)))
      --record(dependent).missing_inputs;
  }
  for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) {
    if (record(task).missing_inputs == 0) apply(task, TaskEvent::inputs_done);
  }
  for (const TaskIndex task : done) {
    if (const TaskKey key = graph_.key(task); key.kind == TaskKind::render)
      checkpoints_.complete(key);
  }
  for (const BlobRef& blob : gone) {
    const TaskKey key = render_task(graph_.timeline().run_of(blob.step()), blob.tile);
    const std::optional<TaskIndex> task = graph_.find(key);
    if (!task) continue;
    if (blob.kind == BlobKind::state) checkpoints_.let_go(key);
    if (blob.kind == BlobKind::film) record(*task).films_let_go = true;
  }
  others_frames_.insert(plan.others_frames.begin(), plan.others_frames.end());
  for (const Cut& cut : plan.cuts) {
    const auto task = graph_.find(cut.task);
    if (!task || (!is_open(status(*task)) && !record(*task).outputs.empty())) continue;
    cuts_[*task] = cut.states;
    if (is_open(status(*task))) use_cut(*task, blobs);
  }
  for (const TaskIndex task : done) add_outputs(task, blobs);

  // Then back from what is needed and not there.
  std::vector<TaskIndex> reopened;
  for (const TaskIndex task : hollow) {
    if (status(task) != TaskStatus::done || !lacks_needed_output(task)) continue;
    const std::vector<TaskIndex> more = reopen(task, blobs);
    reopened.insert(reopened.end(), more.begin(), more.end());
  }
  std::erase_if(cuts_, [&](const auto& cut) { return !is_open(status(cut.first)); });
  return reopened;
}

/// Whether an open task takes what a done one does not have.
bool JobTasks::lacks_needed_output(TaskIndex task) const {
  const TaskKey maker = graph_.key(task);
  const std::vector<TaskIndex> dependents = graph_.dependents(maker);
  return std::any_of(dependents.begin(), dependents.end(), [&](TaskIndex dependent) {
    if (!is_open(status(dependent)) || cuts_.contains(dependent)) return false;
    const std::vector<std::size_t> taken = graph_.taken_outputs(graph_.key(dependent), maker);
    return std::any_of(taken.begin(), taken.end(),
                       [&](std::size_t position) { return position >= outputs(task).size(); });
  });
}

void JobTasks::give_back(TaskIndex task) {
  BATON_CHECK(apply(task, TaskEvent::returned));
  if (record(task).missing_inputs > 0) apply(task, TaskEvent::input_lost);
}

std::vector<TaskIndex> JobTasks::reopen(TaskIndex task, BlobReferences& blobs) {
  std::vector<TaskIndex> reopened;
  std::vector<TaskIndex> lost{task};
  while (!lost.empty()) {
    const TaskIndex next = lost.back();
    lost.pop_back();
    if (status(next) != TaskStatus::done) {  // reached before, on another way
      if (!drop_cut(next, blobs)) continue;
      const std::vector<TaskIndex> gone = ask_inputs_again(next, blobs);
      lost.insert(lost.end(), gone.begin(), gone.end());
      continue;
    }

    // Forget what it made; who waits for that waits longer.
    release_outputs(next, blobs);
    for (const BlobRef& output : outputs(next)) count_output(output, false);
    if (const TaskKey key = graph_.key(next); key.kind == TaskKind::render)
      checkpoints_.reopen(key);
    std::vector<BlobRef> before = std::exchange(record(next).outputs, {});
    const bool is_others = next < graph_.num_frames() && others_frames_.contains(FrameIndex(next));
    if (!before.empty() && !is_others) former_outputs_[next] = std::move(before);
    BATON_CHECK(apply(next, TaskEvent::output_lost));
    reopened.push_back(next);
    for (const TaskIndex dependent : graph_.dependents(graph_.key(next))) {
      ++record(dependent).missing_inputs;
      apply(dependent, TaskEvent::input_lost);
    }

    // It needs its inputs again: what nobody kept must be made again, too.
    if (cuts_.contains(next) && !needs_films(next)) {
      use_cut(next, blobs);
      continue;
    }
    cuts_.erase(next);
    const std::vector<TaskIndex> gone = ask_inputs_again(next, blobs);
    lost.insert(lost.end(), gone.begin(), gone.end());
  }
  for (const TaskIndex again : reopened) {
    if (record(again).missing_inputs == 0) apply(again, TaskEvent::inputs_done);
  }
  return reopened;
}

/// A task that is open again takes its part in the blobs of its inputs. Returns the inputs that are
/// done, but have lost a blob that it takes.
std::vector<TaskIndex> JobTasks::ask_inputs_again(TaskIndex task, BlobReferences& blobs) const {
  std::vector<TaskIndex> gone;
  const TaskKey key = graph_.key(task);
  for (const TaskIndex input : graph_.inputs(key)) {
    if (status(input) != TaskStatus::done) {
      if (cuts_.contains(input) && key.kind != TaskKind::render) gone.push_back(input);
      continue;
    }
    bool is_there = true;
    for (const std::size_t position : graph_.taken_outputs(key, graph_.key(input))) {
      if (position >= outputs(input).size()) {
        is_there = false;
        continue;
      }
      const Digest& blob = outputs(input)[position].digest;
      is_there = is_there && blobs.is_there(blob);
      blobs.expect(blob);
    }
    if (!is_there) gone.push_back(input);
  }
  return gone;
}

const std::vector<BlobRef>& JobTasks::former_outputs(TaskIndex task) const {
  static const std::vector<BlobRef> kNone;
  const auto found = former_outputs_.find(task);
  return found == former_outputs_.end() ? kNone : found->second;
}

std::vector<TaskIndex> JobTasks::give_up(TaskIndex task) {
  BATON_CHECK(apply(task, TaskEvent::exhausted));

  // What needs this task, directly or not, will never be done.
  std::vector<TaskIndex> leased;
  std::vector<TaskIndex> unreachable = graph_.dependents(graph_.key(task));
  while (!unreachable.empty()) {
    const TaskIndex dependent = unreachable.back();
    unreachable.pop_back();
    const bool is_leased = status(dependent) == TaskStatus::leased;
    if (!apply(dependent, TaskEvent::cancelled)) continue;  // reached before, on another way
    if (is_leased) leased.push_back(dependent);
    const std::vector<TaskIndex> more = graph_.dependents(graph_.key(dependent));
    unreachable.insert(unreachable.end(), more.begin(), more.end());
  }
  return leased;
}

void JobTasks::cancel_open() {
  for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) apply(task, TaskEvent::cancelled);
}

void JobTasks::add_failure(TaskIndex task, const Failure& failure, BlobReferences& blobs) {
  has_failed_ = true;
  let_between_go(blobs);
  ended_[task].push_back({failure.lease, failure.worker, true, failure.permanent});
  ++progress_.attempts_lost;
}

void JobTasks::add_returned(TaskIndex task, const LeaseId& lease, const std::string& worker) {
  // One for each worker will do: one that comes again after that is reported again, too.
  std::vector<EndedAttempt>& ended = ended_[task];
  std::erase_if(ended, [&](const EndedAttempt& attempt) {
    return !attempt.failed && attempt.worker == worker;
  });
  ended.push_back({lease, worker});
}

bool JobTasks::has_ended(TaskIndex task, const LeaseId& lease) const {
  const auto found = ended_.find(task);
  if (found == ended_.end()) return false;
  return std::any_of(found->second.begin(), found->second.end(),
                     [&](const EndedAttempt& attempt) { return attempt.lease == lease; });
}

std::vector<TaskIndex> JobTasks::tried() const {
  std::vector<TaskIndex> tasks;
  for (const auto& [task, ended] : ended_) tasks.push_back(task);
  return tasks;
}

std::map<std::string, Blame> JobTasks::blame(TaskIndex task) const {
  std::map<std::string, Blame> blame;
  const auto found = ended_.find(task);
  if (found == ended_.end()) return blame;
  for (const EndedAttempt& attempt : found->second) {
    if (!attempt.failed) continue;
    Blame& of_worker = blame[attempt.worker];
    ++of_worker.failures;
    of_worker.for_good |= attempt.for_good;
  }
  return blame;
}

std::int32_t JobTasks::add_loss(TaskIndex task) {
  ++progress_.attempts_lost;
  return ++record(task).losses;
}

void JobTasks::forgive(const std::string& worker) {
  for (auto& [task, ended] : ended_) {
    for (EndedAttempt& attempt : ended) {
      if (attempt.worker == worker) attempt.for_good = false;
    }
  }
}

void JobTasks::forget_losses() {
  for (Record& record : records_) record.losses = 0;
}

}  // namespace baton
