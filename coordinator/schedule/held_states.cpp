#include "coordinator/schedule/held_states.h"

#include <algorithm>

namespace baton {

bool may_hold(const JobTasks& tasks, TaskIndex task) {
  const JobGraph& graph = tasks.graph();
  const TaskKey key = graph.key(task);
  if (key.kind != TaskKind::render || !graph.carries_state() || !graph.shares_history())
    return false;
  const bool is_last = key.run() + 1 == Run(graph.num_runs());
  const bool is_first_sweep = graph.timeline().sweep_of(graph.steps(key).first) == Sweep(0);
  return !is_last && is_first_sweep && tasks.made().former_outputs(task).empty() &&
         !tasks.ledger().keeps_state(key) && !tasks.ledger().is_cut(task) &&
         !tasks.attempts().has_failed() && tasks.made().tells_makers();
}

std::vector<std::pair<std::string, Digest>> held_inputs(const JobTasks& tasks, TaskIndex task) {
  std::vector<std::pair<std::string, Digest>> held;
  const JobGraph& graph = tasks.graph();
  const OutputBook& made = tasks.made();
  const TaskKey key = graph.key(task);
  const bool has_any = made.totals().num_held > 0 && key.kind == TaskKind::render;
  if (!has_any || tasks.ledger().is_cut(task)) return held;
  for (const TaskIndex input : graph.inputs(key)) {
    const BlobRef* const state = made.held_state(input);
    if (state != nullptr && graph.takes(key, graph.key(input), *state))
      held.emplace_back(made.maker(input), state->digest);
  }
  return held;
}

bool can_read(const JobTasks& tasks, TaskIndex task, const std::string& worker) {
  const auto held = held_inputs(tasks, task);
  return std::all_of(held.begin(), held.end(),
                     [&](const auto& input) { return input.first == worker; });
}

/// They are of the runs from the one before the first open one on.
std::vector<TaskIndex> held_now(const JobTasks& tasks) {
  std::vector<TaskIndex> held;
  const JobGraph& graph = tasks.graph();
  if (tasks.made().totals().num_held == 0) return held;
  const Run first = std::max(Run(0), tasks.book().first_open_run() - 1);
  for (Run run = first; run < Run(graph.num_runs()); ++run) {
    if (tasks.book().num_open_renders(run) == graph.num_tiles()) continue;
    for (std::int32_t tile = 0; tile < graph.num_tiles(); ++tile) {
      const TaskIndex task = *graph.find(render_task(run, tile));
      const BlobRef* const state = tasks.made().held_state(task);
      if (state != nullptr && tasks.ledger().is_needed(tasks.view(), task, *state))
        held.push_back(task);
    }
  }
  return held;
}

std::vector<TaskKey> held_by(const JobTasks& tasks, const std::string& worker) {
  std::vector<TaskKey> keys;
  for (const TaskIndex task : held_now(tasks)) {
    if (tasks.made().maker(task) == worker) keys.push_back(tasks.graph().key(task));
  }
  return keys;
}

std::vector<TaskKey> held_by_strangers(const JobTasks& tasks) {
  return held_by(tasks, tasks.made().stranger());
}

}  // namespace baton
