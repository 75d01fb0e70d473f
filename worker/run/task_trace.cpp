#include "worker/run/task_trace.h"

#include <fmt/format.h>

#include "common/job/plan/task_place.h"

namespace baton {

std::string traced_task(const LeaseId& lease) {
  return fmt::format(R"("job":"{}","kind":"{}","position":{},"tile":{})", lease.job.hex(),
                     task_name(lease.task.kind), lease.task.position, lease.task.tile);
}

TaskSpan::TaskSpan(const Grant& grant)
    : span_(SpanKind::task, std::string(task_name(grant.lease.task.kind))) {
  span_.add_members(traced_task(grant.lease));
  span_.add("attempt", std::int64_t{grant.lease.attempt});
  if (grant.lease.task.kind == TaskKind::assemble) {
    if (!grant.inputs.empty()) span_.add("step", grant.inputs.front().position);
    return;
  }
  if (grant.lease.task.kind == TaskKind::render) {
    span_.add("first", grant.steps.first.value());
    span_.add("last", grant.steps.last.value());
  }
  std::string inputs;
  for (const BlobRef& input : grant.inputs) {
    inputs += fmt::format("{}[{},{},{}]", inputs.empty() ? "" : ",", static_cast<int>(input.kind),
                          input.position, input.tile);
  }
  span_.add_json("inputs", "[" + inputs + "]");
}

void TaskSpan::name(const LoadedJob& loaded, const Grant& grant) {
  span_.rename(
      place_text(place_of(loaded.job, Timeline(loaded.job), grant.lease.task, grant.steps)));
  span_.add("id", loaded.id.hex());
}

void TaskSpan::end(const Result<TaskResult>& result) {
  std::string lost;
  if (!result) {
    lost = result.error().message;
  } else if (!result->unseen.empty()) {
    lost = result->unseen;
  } else if (!result->not_held.empty()) {
    lost = "inputs are not held here any more";
  } else if (result->in_place) {
    lost = "another picture is in the place of the frame";
  }
  if (!lost.empty()) span_.add("lost", lost);
}

}  // namespace baton
