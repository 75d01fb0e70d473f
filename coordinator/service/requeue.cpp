#include "coordinator/service/requeue.h"

#include <fmt/format.h>

#include <algorithm>

#include "coordinator/schedule/job_tasks.h"
#include "coordinator/service/plan_text.h"

namespace baton {
namespace {

/// Pixels of a render task, in all its steps.
std::uint64_t pixels_of(const JobGraph& graph, const TaskKey& task) {
  const StepSpan steps = graph.steps(task);
  return graph.num_pixels(task.tile) *
         static_cast<std::uint64_t>(steps.last.value() - steps.first.value() + 1);
}

}  // namespace

Result<std::set<FrameIndex>> frames_to_requeue(const JobSpec& spec,
                                               const std::vector<FrameNumber>& frames,
                                               const LockedFrames& locked) {
  BATON_ASSIGN(const std::vector<FrameIndex> places, places_of(spec, frames));
  std::set<FrameIndex> found(places.begin(), places.end()), kept;
  for (const FrameIndex frame : found) {
    if (locked.contains(frame)) kept.insert(frame);
  }
  if (!kept.empty()) {
    return Error{ErrorKind::usage,
                 fmt::format("job '{}': {} {} locked: baton job lock --off gives up locks",
                             spec.name, frames_text(spec, kept), are(kept))};
  }
  return found;
}

std::vector<TaskKey> tasks_of_frames(const JobGraph& graph, const std::set<FrameIndex>& frames) {
  const Timeline& timeline = graph.timeline();
  std::vector<TaskKey> tasks;
  std::set<Run> runs;
  for (const FrameIndex frame : frames) {
    tasks.push_back(assemble_task(frame));
    for (Step step = timeline.step_of(frame, Sweep(0)); step <= timeline.last_step_of(frame);
         step = step + timeline.num_frames()) {
      runs.insert(timeline.run_of(step));
      for (std::int32_t tile = 0; graph.has_second_pass() && tile < graph.num_tiles(); ++tile)
        tasks.push_back(second_pass_task(step, tile));
    }
  }
  for (const Run run : runs) {
    for (std::int32_t tile = 0; tile < graph.num_tiles(); ++tile)
      tasks.push_back(render_task(run, tile));
  }
  return tasks;
}

RequeuePlan plan_requeue(const JobSpec& spec, const JournalledJob& known, const LostFiles& lost,
                         const std::set<FrameIndex>& frames, std::optional<JobStatus> ended) {
  JobTasks tasks(spec);
  BlobReferences references;
  tasks.restore(known.completions, lost.spares, references, known.plan);
  const JobGraph& graph = tasks.graph();
  const TaskBook& book = tasks.book();
  std::uint64_t pixels_done = 0;
  for (const Completions::Task& done : known.completions.tasks) {
    if (done.task.kind == TaskKind::render && graph.find(done.task) && !done.outputs.empty())
      pixels_done += pixels_of(graph, done.task);
  }

  std::set<TaskIndex> again;
  const auto reopen = [&](const TaskKey& key) {
    const std::optional<TaskIndex> task = graph.find(key);
    if (!task || book.status(*task) != TaskStatus::done) return;
    for (const TaskIndex reopened : tasks.reopen(*task, references)) again.insert(reopened);
  };
  const bool is_any_done = std::ranges::any_of(tasks_of_frames(graph, frames), [&](auto& key) {
    return book.status(*graph.find(key)) == TaskStatus::done;
  });
  if (is_any_done) std::ranges::for_each(lost.tasks, reopen);
  std::ranges::for_each(tasks_of_frames(graph, frames), reopen);
  // What goes on does all that is open.
  for (TaskIndex task = 0; ended && is_any_done && task < graph.num_tasks(); ++task) {
    if (book.status(task) != TaskStatus::done) again.insert(task);
  }

  // What is rendered, and what that goes back to.
  const Timeline& timeline = graph.timeline();
  std::set<FrameIndex> written, besides, beside;
  std::optional<Step> first;
  std::uint64_t pixels = 0;
  for (const TaskIndex task : again) {
    const TaskKey key = graph.key(task);
    if (key.kind == TaskKind::assemble)
      (frames.contains(key.frame()) ? written : besides).insert(key.frame());
    if (key.kind != TaskKind::render) continue;
    pixels += pixels_of(graph, key);
    const StepSpan steps = graph.steps(key);
    first = std::min(first.value_or(steps.first), steps.first);
    for (Step step = steps.first; step <= steps.last; ++step) {
      const FrameIndex frame = timeline.frame_of(step);
      if (book.status(*graph.find(assemble_task(frame))) == TaskStatus::done) beside.insert(frame);
    }
  }

  RequeuePlan plan;
  plan.num_tasks = again.size();
  if (pixels_done > 0)
    plan.cpu_seconds = known.completions.stats.cpu_seconds * static_cast<double>(pixels) /
                       static_cast<double>(pixels_done);
  if (!written.empty()) {
    plan.plan += fmt::format("{} {} rendered again", frames_text(spec, written), are(written));
    if (graph.carries_state() && first && *first > Step(0))
      plan.plan += fmt::format(", going back to the states of {}",
                               frames_text(spec, {timeline.frame_of(*first - 1)}));
    if (graph.carries_state() && first == Step(0)) plan.plan += ", from the first frame on";
    plan.plan += "\n";
  }
  if (!besides.empty())
    plan.plan += fmt::format("{} {} rendered, too: {}\n", frames_text(spec, besides), are(besides),
                             ended && *ended != JobStatus::done
                                 ? fmt::format("the job is {} and goes on", job_status_name(*ended))
                                 : std::string("what was there is gone"));
  if (!beside.empty())
    plan.plan += fmt::format("{} {} rendered once more with them, and not written\n",
                             frames_text(spec, beside), are(beside));
  std::set<FrameIndex> open;
  std::ranges::set_difference(frames, written, std::inserter(open, open.end()));
  if (!open.empty())
    plan.plan += fmt::format("{} {} not written yet\n", frames_text(spec, open), are(open));
  return plan;
}

}  // namespace baton
