#include <algorithm>

#include "common/base/limits.h"
#include "coordinator/schedule/job_tasks.h"

namespace baton {

Step JobTasks::states_from() const {
  const Timeline& timeline = graph_.timeline();
  if (first_open_run_ >= Run(graph_.num_runs())) return Step(timeline.num_steps());
  return timeline.steps_of(first_open_run_).first - 1;
}

bool JobTasks::may_hold(TaskIndex task) const {
  const TaskKey key = graph_.key(task);
  return key.kind == TaskKind::render && graph_.carries_state() && graph_.shares_history() &&
         key.run() + 1 < Run(graph_.num_runs()) && !keep_all_states_ && !checkpoints_.keeps(key) &&
         graph_.timeline().sweep_of(graph_.steps(key).first) == Sweep(0) && !cuts_.contains(task) &&
         !has_failed_ && makers_.size() <= limits::kMaxWorkers;
}

/// The state of a done task if it is held; else null.
const BlobRef* JobTasks::held_state(TaskIndex task) const {
  const std::vector<BlobRef>& made = outputs(task);
  return !made.empty() && made.front().is_held() ? &made.front() : nullptr;
}

std::vector<std::pair<std::string, Digest>> JobTasks::held_inputs(TaskIndex task) const {
  std::vector<std::pair<std::string, Digest>> held;
  const TaskKey key = graph_.key(task);
  if (num_held_ == 0 || key.kind != TaskKind::render || cuts_.contains(task)) return held;
  for (const TaskIndex input : graph_.inputs(key)) {
    const BlobRef* const state = held_state(input);
    if (state != nullptr && graph_.takes(key, graph_.key(input), *state))
      held.emplace_back(maker(input), state->digest);
  }
  return held;
}

bool JobTasks::can_read(TaskIndex task, const std::string& worker) const {
  const auto held = held_inputs(task);
  return std::all_of(held.begin(), held.end(),
                     [&](const auto& input) { return input.first == worker; });
}

/// The tasks whose states are held and needed. They are of the runs from the one before the first
/// open one on.
std::vector<TaskIndex> JobTasks::held_now() const {
  std::vector<TaskIndex> tasks;
  if (num_held_ == 0) return tasks;
  for (Run run = std::max(Run(0), first_open_run_ - 1); run < Run(graph_.num_runs()); ++run) {
    if (num_open_renders(run) == graph_.num_tiles()) continue;
    for (std::int32_t tile = 0; tile < graph_.num_tiles(); ++tile) {
      const TaskIndex task = *graph_.find(render_task(run, tile));
      const BlobRef* state = held_state(task);
      if (state != nullptr && num_needs(task, *state) > 0) tasks.push_back(task);
    }
  }
  return tasks;
}

std::vector<TaskKey> JobTasks::held_by(const std::string& worker) const {
  std::vector<TaskKey> tasks;
  for (const TaskIndex task : held_now()) {
    if (maker(task) == worker) tasks.push_back(graph_.key(task));
  }
  return tasks;
}

void JobTasks::share_inputs(TaskIndex task, const std::string& worker, BlobReferences& blobs) {
  const TaskKey key = graph_.key(task);
  if (key.kind != TaskKind::render || !graph_.shares_history() || cuts_.contains(task)) return;
  for (const TaskIndex input : graph_.inputs(key)) {
    if (record(input).is_shared || maker(input) == worker) continue;
    record(input).is_shared = true;
    for (const BlobRef& output : outputs(input)) {
      if (!checkpoints_.keeps(graph_.key(input)) && stays(input, output)) blobs.add(output);
    }
  }
}

std::optional<TaskIndex> JobTasks::publish(const PublishedState& state, const std::string& worker,
                                           BlobReferences& blobs) {
  if (state.held.kind != BlobKind::state) return std::nullopt;
  const Timeline& timeline = graph_.timeline();
  const Step step = state.held.step();
  if (step < Step(0) || step >= Step(timeline.num_steps())) return std::nullopt;
  const auto task = graph_.find(render_task(timeline.run_of(step), state.held.tile));
  const BlobRef* held = task ? held_state(*task) : nullptr;
  const bool fits = held != nullptr && *held == state.held && maker(*task) == worker &&
                    !state.published.is_held() && state.published.kind == held->kind &&
                    state.published.position == held->position &&
                    state.published.tile == held->tile;
  if (!fits) return std::nullopt;

  // Whoever needs it needs the blob from now on.
  release_outputs(*task, blobs);
  count_output(*held, false);
  record(*task).outputs.front() = state.published;
  record(*task).is_shared = true;
  count_output(state.published, true);
  add_outputs(*task, blobs);
  return task;
}

}  // namespace baton
