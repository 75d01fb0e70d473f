#include "coordinator/schedule/job_tasks.h"

#include <algorithm>

#include "common/base/check.h"

namespace baton {

JobTasks::JobTasks(const JobSpec& spec)
    : graph_(spec), book_(graph_), made_(graph_), ledger_(spec, graph_) {}

JobProgress JobTasks::progress() const {
  const TaskCounts& tasks = book_.counts();
  const OutputBook::Totals& made = made_.totals();
  return {.tasks_total = tasks.total,
          .tasks_done = tasks.done,
          .tasks_leased = tasks.leased,
          .tasks_failed = tasks.failed,
          .tasks_open = tasks.open,
          .attempts_lost = attempts_.num_lost(),
          .frames_done = made.frames,
          .state_bytes = made.state_bytes,
          .state_pixels = made.state_pixels};
}

void JobTasks::complete(TaskIndex task, const Completion& completion, const std::string& worker,
                        bool is_shared, BlobReferences& blobs) {
  made_.set_maker(task, worker);
  if (!made_.is_counted(task)) {
    stats_.merge(completion.made.stats);
    const bool is_frame = completion.task.kind == TaskKind::assemble;
    for (const FrameStats& stats : completion.made.frames)
      frames_[is_frame ? stats.frame() : graph_.timeline().frame_of(stats.step())].merge(stats);
  }

  // What this task needed may go; what needed this task comes closer.
  force_done(task, completion.made.outputs);
  ledger_.complete(view(), task, is_shared, blobs);
  for (const TaskIndex dependent : graph_.dependents(completion.task))
    book_.add_input(graph_, dependent);
}

Completion JobTasks::leave_frame(TaskIndex task, BlobReferences& blobs) {
  const TaskKey key = graph_.key(task);
  Completion completion{key, {{BlobRef::any_image(key.frame())}}};
  complete(task, completion, made_.stranger(), /*is_shared=*/true, blobs);
  return completion;
}

/// Brings a task to done, along the legal way, and enters what it made.
void JobTasks::force_done(TaskIndex task, const std::vector<BlobRef>& outputs) {
  book_.apply(graph_, task, TaskEvent::inputs_done);
  book_.apply(graph_, task, TaskEvent::granted);
  BATON_CHECK(book_.apply(graph_, task, TaskEvent::completed));
  made_.enter(graph_, task, outputs);
}

std::vector<TaskIndex> JobTasks::restore(const Completions& completions,
                                         const std::vector<BlobRef>& gone, BlobReferences& blobs,
                                         const JobPlan& plan) {
  // First all statuses: who needs what follows from them.
  std::vector<TaskIndex> done, hollow;
  std::vector<BlobRef> outputs;
  for (const Completions::Task& recorded : completions.tasks) {
    const std::optional<TaskIndex> task = graph_.find(recorded.task);
    if (!task || book_.status(*task) == TaskStatus::done) continue;
    outputs = recorded.outputs;
    const bool is_hollow =
        recorded.task.kind != TaskKind::assemble &&
        (outputs.empty() || !graph_.check_outputs(recorded.task, outputs, JobGraph::Extent::state));
    if (!is_hollow && graph_.check_outputs(recorded.task, outputs)) continue;
    if (is_hollow) hollow.push_back(*task);
    force_done(*task, outputs);
    done.push_back(*task);
  }
  for (const TaskIndex task : done) {
    for (const TaskIndex dependent : graph_.dependents(graph_.key(task)))
      book_.add_input(graph_, dependent);
  }
  stats_ = completions.stats;
  for (const auto& [step, stats] : completions.steps)
    frames_[graph_.timeline().frame_of(step)].merge(stats);
  for (const auto& [frame, stats] : completions.frames) frames_[frame].merge(stats);
  others_frames_.insert(plan.others_frames.begin(), plan.others_frames.end());
  ledger_.restore(view(), done, gone, plan.cuts, blobs);

  // Then back from what is needed and not there.
  std::vector<TaskIndex> reopened;
  for (const TaskIndex task : hollow) {
    const bool is_done = book_.status(task) == TaskStatus::done;
    if (!is_done || !ledger_.lacks_needed_output(view(), task)) continue;
    const std::vector<TaskIndex> more = reopen(task, blobs);
    reopened.insert(reopened.end(), more.begin(), more.end());
  }
  ledger_.forget_done_cuts(view());
  return reopened;
}

void JobTasks::remember(const Completions::Task& former) {
  const std::optional<TaskIndex> task = graph_.find(former.task);
  std::vector<BlobRef> outputs = former.outputs;
  if (task && !graph_.check_outputs(former.task, outputs)) made_.remember(*task, outputs);
}

std::optional<TaskIndex> JobTasks::publish(const PublishedState& state, const std::string& worker,
                                           BlobReferences& blobs) {
  if (state.held.kind != BlobKind::state) return std::nullopt;
  const Timeline& timeline = graph_.timeline();
  const Step step = state.held.step();
  if (step < Step(0) || step >= Step(timeline.num_steps())) return std::nullopt;
  const auto task = graph_.find(render_task(timeline.run_of(step), state.held.tile));
  const BlobRef* const held = task ? made_.held_state(*task) : nullptr;
  const bool fits = held != nullptr && *held == state.held && made_.maker(*task) == worker &&
                    !state.published.is_held() && state.published.kind == held->kind &&
                    state.published.position == held->position &&
                    state.published.tile == held->tile;
  if (!fits) return std::nullopt;

  // Whoever needs it needs the blob from now on.
  ledger_.release_outputs(view(), *task, blobs);
  made_.publish_state(graph_, *task, state.published);
  ledger_.add_shared_outputs(view(), *task, blobs);
  return task;
}

void JobTasks::give_back(TaskIndex task) {
  BATON_CHECK(book_.apply(graph_, task, TaskEvent::returned));
  if (!book_.has_inputs(task)) book_.apply(graph_, task, TaskEvent::input_lost);
}

std::vector<TaskIndex> JobTasks::reopen(TaskIndex task, BlobReferences& blobs) {
  std::vector<TaskIndex> reopened;
  std::vector<TaskIndex> lost{task};
  while (!lost.empty()) {
    const TaskIndex next = lost.back();
    lost.pop_back();
    std::vector<TaskIndex> gone;
    if (book_.status(next) != TaskStatus::done) {  // reached before, on another way
      gone = ledger_.drop_cut(view(), next, blobs);
    } else {
      // Forget what it made; who waits for that waits longer.
      ledger_.reopen(view(), next, blobs);
      const bool is_others =
          next < graph_.num_frames() && others_frames_.contains(FrameIndex(next));
      made_.remove(graph_, next, /*remember=*/!is_others);
      BATON_CHECK(book_.apply(graph_, next, TaskEvent::output_lost));
      reopened.push_back(next);
      for (const TaskIndex dependent : graph_.dependents(graph_.key(next)))
        book_.take_input(graph_, dependent);

      // It needs its inputs again: what nobody kept must be made again, too.
      gone = ledger_.need_inputs(view(), next, blobs);
    }
    lost.insert(lost.end(), gone.begin(), gone.end());
  }
  for (const TaskIndex again : reopened) {
    if (book_.has_inputs(again)) book_.apply(graph_, again, TaskEvent::inputs_done);
  }
  return reopened;
}

std::vector<TaskIndex> JobTasks::reopen_unfinished(BlobReferences& blobs) {
  std::vector<TaskIndex> reopened;
  const auto reopen_if_needed = [&](TaskIndex task) {
    const std::vector<BlobRef>& outputs = made_.outputs(task);
    const bool is_needed = std::ranges::any_of(outputs, [&](const BlobRef& output) {
      return output.kind != BlobKind::state && ledger_.is_needed(view(), task, output);
    });
    if (!is_needed) return;
    const std::vector<TaskIndex> more = reopen(task, blobs);
    reopened.insert(reopened.end(), more.begin(), more.end());
  };
  // From the end of each frame back: second passes, later sweeps, earlier ones.
  const TaskIndex first_render = *graph_.find(render_task(Run(0), 0));
  for (TaskIndex task = graph_.num_frames(); task < first_render; ++task) reopen_if_needed(task);
  for (TaskIndex task = graph_.num_tasks() - 1; task >= first_render; --task)
    reopen_if_needed(task);
  ledger_.let_films_go(view(), blobs);
  return reopened;
}

std::vector<TaskIndex> JobTasks::give_up(TaskIndex task) {
  BATON_CHECK(book_.apply(graph_, task, TaskEvent::exhausted));

  // What needs this task, directly or not, will never be done.
  std::vector<TaskIndex> leased;
  std::vector<TaskIndex> unreachable = graph_.dependents(graph_.key(task));
  while (!unreachable.empty()) {
    const TaskIndex dependent = unreachable.back();
    unreachable.pop_back();
    const bool is_leased = book_.status(dependent) == TaskStatus::leased;
    // One that is closed was reached before, on another way.
    if (!book_.apply(graph_, dependent, TaskEvent::cancelled)) continue;
    if (is_leased) leased.push_back(dependent);
    const std::vector<TaskIndex> more = graph_.dependents(graph_.key(dependent));
    unreachable.insert(unreachable.end(), more.begin(), more.end());
  }
  return leased;
}

void JobTasks::cancel_open() {
  for (TaskIndex task = 0; task < graph_.num_tasks(); ++task)
    book_.apply(graph_, task, TaskEvent::cancelled);
}

void JobTasks::add_failure(TaskIndex task, const Failure& failure, BlobReferences& blobs) {
  attempts_.add_failure(task, failure);
  let_between_go(blobs);
}

}  // namespace baton
