#include "coordinator/schedule/store_room.h"

#include <algorithm>
#include <vector>

#include "common/job/motion.h"
#include "common/job/plan/store_estimate.h"

namespace baton {
namespace {

/// By this share of the limit the store may hold more, so that runs that were begun end.
constexpr std::uint64_t kSlackShare = 8;
/// Runs of a job that are in work together.
constexpr std::int32_t kRunsInWork = 2;

std::uint64_t times(std::int64_t count, std::uint64_t bytes) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(count, 0)) * bytes;
}

std::int32_t num_open_second_passes(const JobInStore& job, Step step) {
  std::int32_t count = 0;
  for (std::int32_t tile = 0; tile < job.graph.num_tiles(); ++tile)
    count += is_open(job.book.status(*job.graph.find(second_pass_task(step, tile)))) ? 1 : 0;
  return count;
}

/// The run of a task's frames.
Run run_of(const JobGraph& graph, const TaskKey& key) {
  return key.kind == TaskKind::render ? key.run() : graph.timeline().run_of(key.step());
}

/// The end of the runs that are in work: of those that were begun others may be wanted once more.
Run end_in_work(const JobInStore& job) {
  return std::min(job.begun_runs, job.book.first_open_run() + kRunsInWork);
}

/// What a render task of a run adds: in later sweeps its films take the place of those before.
std::uint64_t added_bytes(const JobInStore& job, Run run) {
  const Timeline& timeline = job.graph.timeline();
  const StepSpan steps = timeline.steps_of(run);
  const std::uint64_t made = job.sizes.mean(job.graph, render_task(run, 0));
  if (timeline.sweep_of(steps.first) == Sweep(0)) return made;
  return made - std::min(made, times(steps.size(), job.sizes.mean_film()));
}

/// What a job takes at most.
struct Claim {
  std::uint64_t stays = 0;     ///< states and films between its runs
  std::uint64_t run = 0;       ///< beside them, while a run is made
  std::uint64_t replaced = 0;  ///< states that go while a run is made
  std::uint64_t at_end = 0;    ///< what goes when it has ended

  std::uint64_t whole() const { return stays + run; }
};
Claim claim_of(const JobInStore& job) {
  const JobGraph& graph = job.graph;
  const TaskKey render = render_task(Run(0), 0);
  const std::int64_t tiles = graph.num_tiles();
  const std::int64_t sets = num_state_sets(job.spec);
  const std::uint64_t set = sets > 0 ? times(tiles, job.sizes.mean_state()) : 0;
  const std::int64_t films_stay = num_films_that_stay(job.spec);
  std::uint64_t films = times(tiles, job.sizes.mean(graph, render)) -
                        times(graph.num_outputs(render, BlobKind::state), set);
  if (graph.has_second_pass()) {
    const std::int64_t steps = graph.timeline().steps_of(Run(0)).size();
    films += times(steps * tiles, job.sizes.mean(graph, second_pass_task(Step(0), 0)));
  }
  // A tile has its old state and its new one for a moment; in motion others read the old one.
  const bool is_shared = shares_history(job.spec);
  const std::uint64_t twice = is_shared ? set : std::min(set, 4 * job.sizes.largest(graph, render));
  const bool has_all = job.book.first_open_run().value() >= sets;
  // So do films that stay: in the first sweep they come to be there, later they are replaced.
  if (films_stay > 0) films = std::min(films, 4 * job.sizes.largest(graph, render));
  return {.stays = times(sets, set) + times(tiles * films_stay, job.sizes.mean_film()),
          .run = films + twice,
          .replaced = has_all && !is_shared ? set : 0,
          .at_end = times(sets - 1, set)};
}

/// Whether a job may be begun beside others: whether all that were begun, and this one, can end one
/// after the other [Dijkstra 1965, the banker's algorithm], a run being what is lent. Those that
/// could not even alone are not waited for; paused ones are to end, too.
bool can_all_end(const StoreRoom& room, const JobInStore& job, std::span<const JobInStore> others) {
  const std::uint64_t held = room.used - std::min(room.used, room.kept);
  std::vector<Claim> claims{claim_of(job)};
  std::uint64_t taken = room.kept + claims[0].stays;
  for (const JobInStore& other : others) {
    if (other.begun_runs == Run(0)) continue;
    if (job.yields) return false;
    const Claim claim = claim_of(other);
    if (claim.whole() > room.limit + room.limit / kSlackShare) {
      taken += std::min(claim.stays, held);
      continue;
    }
    taken += claim.stays;
    claims.push_back(claim);
  }
  if (claims.size() == 1) return true;  // it is as if it were alone
  // What is not made may turn out larger.
  const std::uint64_t budget = room.limit - room.limit / kSlackShare;
  if (claims[0].whole() > room.limit || taken > budget) return false;
  std::uint64_t free = budget - taken;
  std::ranges::sort(claims, {}, &Claim::run);
  for (const Claim& claim : claims) {
    if (claim.run > free) return false;
    free += claim.at_end;
  }
  return true;
}

}  // namespace

std::uint64_t unmade_bytes(const JobInStore& job, Run end) {
  const JobGraph& graph = job.graph;
  std::uint64_t bytes = 0;
  for (Run run = job.book.first_open_run(); run < end; ++run)
    bytes += times(job.book.num_open_renders(run), added_bytes(job, run));
  if (!graph.has_second_pass() || end == Run(0)) return bytes;
  const Timeline& timeline = graph.timeline();
  const Step last = timeline.steps_of(end - 1).last;
  for (Step step = timeline.last_step_of(job.book.first_open_frame()); step <= last; ++step)
    bytes +=
        times(num_open_second_passes(job, step), job.sizes.mean(graph, second_pass_task(step, 0)));
  return bytes;
}

std::uint64_t begun_bytes(const JobInStore& job) { return unmade_bytes(job, end_in_work(job)); }

std::uint64_t needed_bytes(const JobInStore& job, TaskIndex task) {
  const TaskKey key = job.graph.key(task);
  const std::uint64_t of_frames =
      key.kind == TaskKind::second_pass
          ? times(num_open_second_passes(job, key.step()), job.sizes.mean(job.graph, key))
          : unmade_bytes(job, run_of(job.graph, key) + 1);
  return std::max(job.sizes.largest(job.graph, key), of_frames);
}

Room room_for(const StoreRoom& room, const JobInStore& job, std::span<const JobInStore> others,
              TaskIndex task, Room before) {
  const TaskKey key = job.graph.key(task);
  if (room.limit == 0 || key.kind == TaskKind::assemble) return Room::enough;
  const auto enough_if = [](bool is_enough) { return is_enough ? Room::enough : Room::too_little; };
  const bool is_new = job.begun_runs == Run(0);
  if (is_new && !can_all_end(room, job, others)) return Room::beside;
  // Where sizes are estimated and nobody works, one task tells more.
  if (room.is_idle && !job.sizes.are_known(job.graph, key))
    return enough_if(room.used < room.limit);
  const std::uint64_t more = room.limit + room.limit / kSlackShare;
  const std::uint64_t with_task = room.used + room.expected + job.sizes.largest(job.graph, key);
  if (with_task > (room.is_idle ? more : room.limit)) return Room::too_little;

  const bool is_begun =
      key.kind == TaskKind::second_pass || run_of(job.graph, key) < end_in_work(job);
  std::uint64_t bytes = room.used + needed_bytes(job, task);
  if (is_begun && room.is_idle && bytes <= more) return Room::enough;
  for (const JobInStore& other : others) {
    const std::uint64_t unmade = begun_bytes(other);
    const bool is_stuck = room.is_idle && room.used + unmade > more;  // it can wait
    if (other.may_go_on && !is_stuck) bytes += unmade;
  }
  if (is_begun) return enough_if(bytes <= more);
  if (!room.is_idle && (before == Room::too_little || (before == Room::beside && is_new)))
    return before;
  // Nobody else makes room.
  const std::uint64_t replaced = room.is_idle ? claim_of(job).replaced : 0;
  return enough_if(bytes - std::min(bytes, replaced) <= room.limit);
}

}  // namespace baton
