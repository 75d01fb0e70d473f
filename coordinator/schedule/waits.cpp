#include "coordinator/schedule/waits.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/size_text.h"

namespace baton {
namespace {

std::string room_text(const Scheduler& scheduler, const Scheduler::Job& job) {
  const std::uint64_t ended = scheduler.kept_bytes();
  const auto open = std::ranges::count_if(scheduler.jobs(), [&](const Digest& digest) {
    return is_open(scheduler.find_job(digest)->status);
  });
  return fmt::format(
      "room in the store: it holds {} of the {} that --store-limit allows, {} of them of jobs that "
      "have ended and the rest of {}, and its next frames need about {}: raise the limit{}",
      bytes_text(scheduler.store_bytes()), bytes_text(scheduler.room().limit), bytes_text(ended),
      open == 1 ? "this one" : fmt::format("{} open ones", open),
      bytes_text(needed_bytes(job.in_store(), *job.tasks.book().ready().begin())),
      ended > 0 ? ", or delete ended jobs (`baton job list --all`)" : "");
}

}  // namespace

bool lacks_room(const Scheduler& scheduler, const Digest& digest) {
  const Scheduler::Job& job = *scheduler.find_job(digest);
  const std::set<TaskIndex>& ready = job.tasks.book().ready();
  if (job.status != JobStatus::running || !scheduler.leases().empty() || ready.empty())
    return false;
  // Assembly makes room; its tasks come first.
  for (const Digest& other : scheduler.in_turn()) {
    const JobTasks& tasks = scheduler.find_job(other)->tasks;
    if (!tasks.book().ready().empty() && *tasks.book().ready().begin() < tasks.graph().num_frames())
      return false;
  }
  return RoomOfTasks(scheduler, job, Room::enough).most() != Room::enough;
}

std::string waits_for(const Scheduler& scheduler, const Digest& digest, TimePoint now) {
  const Scheduler::Job& job = *scheduler.find_job(digest);
  const LeaseBook& leases = scheduler.leases();
  if (!is_open(job.status) || !job.waits.empty()) return job.waits;
  if (scheduler.lacks_renderer(digest)) {
    // Behind the instruction set it says by which build.
    const auto build_of = [](const std::string& renderer) {
      return renderer.substr(std::min(renderer.find(", baton "), renderer.size()));
    };
    const bool is_one_build = std::ranges::any_of(leases.connected(), [&](const auto& worker) {
      return build_of(leases.renderer_of(worker)) == build_of(job.renderer);
    });
    return fmt::format(
        "a worker that renders as what is done was rendered, with {}: those that are connected "
        "render with {}, and pixels may differ. --restart renders all frames again, --from-frame N "
        "those from N on{}",
        job.renderer, leases.renderer_of(leases.connected().front()),
        is_one_build ? "; `baton-worker --isa` makes unlike machines alike" : "");
  }
  if (lacks_room(scheduler, digest)) return room_text(scheduler, job);
  if (leases.connected().empty()) return {};
  const Crew crew = job.crew(leases, now);
  if (const std::string unseen = job.standings.unseen(); !unseen.empty() && are_all_blind(crew))
    return fmt::format("a worker that sees {}", unseen);
  for (const TaskIndex task : job.tasks.attempts().tried()) {
    if (job.tasks.book().status(task) != TaskStatus::ready) continue;
    if (!somebody_may_try(crew, job.tasks.attempts().blame(task)))
      return fmt::format("a worker that can do {}: those that are connected have failed it or rest",
                         task_text(job, job.tasks.graph().key(task)));
  }
  return {};
}

}  // namespace baton
