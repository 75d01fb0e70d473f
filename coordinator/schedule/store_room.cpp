#include "coordinator/schedule/store_room.h"

#include <algorithm>

namespace baton {
namespace {

/// By this share of the limit the store may hold more, so that a run that was begun ends.
constexpr std::uint64_t kSlackShare = 8;

}  // namespace

std::uint64_t unmade_bytes(const JobInStore& job, Run end) {
  const JobGraph& graph = job.graph;
  std::uint64_t bytes = 0;
  for (Run run = job.book.first_open_run(); run < end; ++run) {
    bytes += static_cast<std::uint64_t>(job.book.num_open_renders(run)) *
             job.sizes.mean(graph, render_task(run, 0));
  }
  if (!graph.has_second_pass() || end == Run(0)) return bytes;
  const Timeline& timeline = graph.timeline();
  const Step first_unwritten = timeline.last_step_of(job.book.first_open_frame());
  const std::int32_t steps = timeline.steps_of(end - 1).last + 1 - first_unwritten;
  return bytes + static_cast<std::uint64_t>(std::max(0, steps)) *
                     static_cast<std::uint64_t>(graph.num_tiles()) *
                     job.sizes.mean(graph, second_pass_task(Step(0), 0));
}

namespace {

/// What goes from the store while a run is made: the states that it goes on from.
std::uint64_t replaced_bytes(const JobInStore& job, Run run) {
  const bool goes_on =
      run > Run(0) && job.graph.num_outputs(render_task(run - 1, 0), BlobKind::state) > 0;
  return goes_on ? static_cast<std::uint64_t>(job.graph.num_tiles()) * job.sizes.mean_state() : 0;
}

/// The run of a task's frames.
Run run_of(const JobGraph& graph, const TaskKey& key) {
  return key.kind == TaskKind::render ? key.run() : graph.timeline().run_of(key.step());
}

}  // namespace

std::uint64_t needed_bytes(const JobInStore& job, TaskIndex task) {
  const TaskKey key = job.graph.key(task);
  return std::max(job.sizes.largest(job.graph, key), unmade_bytes(job, run_of(job.graph, key) + 1));
}

bool has_room(const StoreRoom& room, const JobInStore& job, std::span<const JobInStore> others,
              TaskIndex task, bool others_wait) {
  const TaskKey key = job.graph.key(task);
  if (room.limit == 0 || key.kind == TaskKind::assemble) return true;
  // Where sizes are estimated and nobody works, one task tells more.
  if (room.is_idle && !job.sizes.are_known(job.graph, key)) return room.used < room.limit;
  const std::uint64_t more = room.limit + room.limit / kSlackShare;
  if (room.used + room.expected + job.sizes.largest(job.graph, key) >
      (room.is_idle ? more : room.limit))
    return false;
  const Run run = run_of(job.graph, key);
  const bool is_begun = run < job.begun_runs;
  if (!is_begun && others_wait) return false;
  // What was begun is finished, although tiles turn out larger than those before: where nobody
  // works by one that can end alone.
  std::uint64_t bytes = room.used + unmade_bytes(job, run + 1);
  if (room.is_idle) bytes -= std::min(bytes, replaced_bytes(job, run));
  if (is_begun && room.is_idle) return bytes <= more;
  for (const JobInStore& other : others) bytes += unmade_bytes(other, other.begun_runs);
  return bytes <= (is_begun ? more : room.limit);
}

}  // namespace baton
