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

bool has_room(const StoreRoom& room, const JobInStore& job, std::span<const JobInStore> others,
              TaskIndex task, bool others_wait) {
  const TaskKey key = job.graph.key(task);
  if (room.limit == 0 || key.kind == TaskKind::assemble) return true;
  const bool is_render = key.kind == TaskKind::render;
  const Run run = is_render ? key.run() : job.graph.timeline().run_of(key.step());
  const std::uint64_t largest = job.sizes.largest(job.graph, key);
  if (!room.fits(largest)) {
    if (!room.is_idle) return false;
    // Where sizes are estimated and nobody works, one task tells more. What was begun is finished
    // although tiles turn out larger than those before.
    if (!job.sizes.are_known(job.graph, key)) return room.used < room.limit;
    return run < job.begun_runs && room.used + largest <= room.limit + room.limit / kSlackShare;
  }
  // What an idle farm does not begin nobody begins.
  if (room.is_idle) return true;
  // What is lost of earlier runs, and made again, comes first.
  if (run < job.begun_runs) return room.used + unmade_bytes(job, run) <= room.limit;
  if (others_wait) return false;
  std::uint64_t bytes = room.used + unmade_bytes(job, run + 1);
  for (const JobInStore& other : others) bytes += unmade_bytes(other, other.begun_runs);
  return bytes <= room.limit;
}

}  // namespace baton
