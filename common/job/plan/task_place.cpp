#include "common/job/plan/task_place.h"

namespace baton {

TaskPlace place_of(const JobSpec& job, const Timeline& timeline, const TaskKey& task,
                   std::uint32_t attempt) {
  const StepSpan steps = task.kind == TaskKind::render ? timeline.steps_of(task.run()) : StepSpan();
  return place_of(job, timeline, task, steps, attempt);
}

TaskPlace place_of(const JobSpec& job, const Timeline& timeline, const TaskKey& task,
                   const StepSpan& steps, std::uint32_t attempt) {
  const auto number = [&](FrameIndex frame) { return job.frames[frame.index()]; };
  TaskPlace place{.kind = task.kind, .tile = task.tile, .attempt = attempt};
  switch (task.kind) {
    case TaskKind::assemble:
      place.first = place.last = number(task.frame());
      break;
    case TaskKind::second_pass:
      place.first = place.last = number(timeline.frame_of(task.step()));
      break;
    case TaskKind::render:
      place.first = number(timeline.frame_of(steps.first));
      place.last = number(timeline.frame_of(steps.last));
      break;
  }
  return place;
}

}  // namespace baton
