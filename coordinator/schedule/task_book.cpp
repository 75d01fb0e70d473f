#include "coordinator/schedule/task_book.h"

#include <algorithm>

#include "common/base/check.h"

namespace baton {

TaskBook::TaskBook(const JobGraph& graph)
    : records_(static_cast<std::size_t>(graph.num_tasks())),
      open_renders_(static_cast<std::size_t>(graph.num_runs()), graph.num_tiles()) {
  counts_.total = counts_.open = records_.size();
  for (TaskIndex task = 0; task < graph.num_tasks(); ++task) {
    record(task).missing_inputs = graph.num_inputs(graph.key(task));
    if (has_inputs(task)) apply(graph, task, TaskEvent::inputs_done);
  }
}

/// change: 1, or -1 as an unsigned number, which wraps.
void TaskBook::count(TaskStatus status, std::uint64_t change) {
  if (is_open(status)) counts_.open += change;
  if (status == TaskStatus::leased) counts_.leased += change;
  if (status == TaskStatus::done) counts_.done += change;
  if (status == TaskStatus::failed) counts_.failed += change;
}

bool TaskBook::apply(const JobGraph& graph, TaskIndex task, TaskEvent event) {
  Record& r = record(task);
  const std::optional<TaskStatus> next = next_status(r.status, event);
  if (!next) return false;

  // Leave the old status, enter the new one.
  const bool was_open = is_open(r.status);
  if (r.status == TaskStatus::ready) ready_.erase(task);
  count(r.status, ~std::uint64_t{0});
  r.status = *next;
  count(r.status, 1);
  if (r.status == TaskStatus::ready) ready_.insert(task);

  if (task < graph.num_frames()) {  // its assembly
    TaskIndex first = std::min(first_open_frame_.value(), task);
    while (first < graph.num_frames() && !is_open(status(first))) ++first;
    first_open_frame_ = FrameIndex(first);
  }
  if (was_open != is_open(r.status)) count_run(graph, task, is_open(r.status));
  return true;
}

/// A task was opened or closed.
void TaskBook::count_run(const JobGraph& graph, TaskIndex task, bool opened) {
  const TaskKey key = graph.key(task);
  if (key.kind != TaskKind::render) return;
  open_renders_[key.run().index()] += opened ? 1 : -1;
  first_open_run_ = std::min(first_open_run_, key.run());
  while (first_open_run_ < Run(graph.num_runs()) && num_open_renders(first_open_run_) == 0)
    ++first_open_run_;
}

std::uint32_t TaskBook::grant(const JobGraph& graph, TaskIndex task) {
  take_up(graph, task);
  return ++record(task).attempts;
}

void TaskBook::take_up(const JobGraph& graph, TaskIndex task) {
  BATON_CHECK(apply(graph, task, TaskEvent::granted));
}

void TaskBook::add_input(const JobGraph& graph, TaskIndex task) {
  if (--record(task).missing_inputs == 0) apply(graph, task, TaskEvent::inputs_done);
}

void TaskBook::take_input(const JobGraph& graph, TaskIndex task) {
  ++record(task).missing_inputs;
  apply(graph, task, TaskEvent::input_lost);
}

Step first_open_step(const JobGraph& graph, const TaskBook& book) {
  const Timeline& timeline = graph.timeline();
  const Step unwritten = timeline.last_step_of(book.first_open_frame());
  if (book.first_open_run() >= Run(graph.num_runs())) return unwritten;
  return std::min(unwritten, timeline.steps_of(book.first_open_run()).first);
}

Step states_from(const JobGraph& graph, const TaskBook& book) {
  const Timeline& timeline = graph.timeline();
  if (book.first_open_run() >= Run(graph.num_runs())) return Step(timeline.num_steps());
  return timeline.steps_of(book.first_open_run()).first - 1;
}

}  // namespace baton
