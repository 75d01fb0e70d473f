#include "coordinator/schedule/scheduler.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/job/plan/estimate.h"
#include "common/job/plan/task_place.h"
#include "coordinator/schedule/held_states.h"

namespace baton {
namespace {

/// Follows the longest of the last values: up at once, down by a tenth each time.
void follow_longest(double& longest, double value) {
  longest = std::max(value, longest + (value - longest) / 10);
}

}  // namespace

std::vector<Action> Scheduler::step(const Event& event, TimePoint now) {
  Actions actions;
  std::visit([&](const auto& e) { on(e, now, actions); }, event);
  serve(now, actions);

  // Answer the one who asked, and name what nobody needs any more.
  if (const auto* request = std::get_if<WorkRequested>(&event)) {
    if (leases_.wants(request->worker)) actions.push_back(ReportNoWork{request->worker});
  }
  if (std::vector<Digest> garbage = blobs_.take_garbage(); !garbage.empty()) {
    actions.push_back(RemoveBlobs{std::move(garbage)});
  }
  return actions;
}

const Scheduler::Job* Scheduler::find_job(const Digest& job) const {
  const auto found = jobs_.find(job);
  return found == jobs_.end() ? nullptr : &found->second;
}

bool is_made_again(const Scheduler& scheduler, const Digest& blob) {
  return std::ranges::any_of(scheduler.leases().all(), [&](const auto& lease) {
    const auto& [job, task] = lease.first;
    const Scheduler::Job* const known = scheduler.find_job(job);
    if (known == nullptr) return false;
    const std::vector<BlobRef>& former = known->tasks.made().former_outputs(task);
    return std::ranges::find(former, blob, &BlobRef::digest) != former.end();
  });
}

std::vector<Digest> Scheduler::jobs() const {
  std::map<std::uint64_t, Digest> by_sequence;
  for (const auto& [digest, job] : jobs_) by_sequence[job.sequence] = digest;
  std::vector<Digest> result;
  for (const auto& [sequence, digest] : by_sequence) result.push_back(digest);
  return result;
}

std::vector<Digest> Scheduler::in_turn() const {
  std::vector<Digest> result;
  for (const auto& [rank, digest] : running_) result.push_back(digest);
  return result;
}

TaskPlace place_of(const Scheduler::Job& job, const TaskKey& task, std::uint32_t attempt) {
  return place_of(job.spec, job.tasks.graph().timeline(), task, attempt);
}

std::string task_text(const Scheduler::Job& job, const TaskKey& task) {
  std::string text = place_text(place_of(job, task));
  if (job.spec.quality.sweeps == 1 || task.kind != TaskKind::render) return text;
  const Timeline& timeline = job.tasks.graph().timeline();
  const Sweep sweep = timeline.sweep_of(timeline.steps_of(task.run()).first);
  return text + fmt::format(", sweep {}", sweep.value() + 1);
}

// ---- events: jobs -------------------------------------------------------------------------------

void Scheduler::on(const JobAdded& event, TimePoint, Actions& actions) {
  // A job that has ended makes room for its new life; one that runs goes on.
  std::uint64_t sequence = next_sequence_;
  if (Job* old = find(event.job)) {
    if (is_open(old->status)) return;
    sequence = old->sequence;
    old->tasks.release_all(blobs_);
    jobs_.erase(event.job);
  } else {
    ++next_sequence_;
  }

  // Take up what the journal knows; all else is fresh.
  Job& job = jobs_
                 .emplace(event.job, Job{event.spec, event.status, sequence, JobTasks(event.spec),
                                         TileHomes(event.spec), max_frames_ahead(event.spec),
                                         BlobSizes(event.spec)})
                 .first->second;
  job.waits = event.waits;
  job.renderer = event.renderer;
  job.is_mixed = event.is_mixed;
  job.homes.share_out(leases_.alike(job.renderer));
  replay(job, event, actions);
  if (!is_open(event.status)) {
    job.tasks.cancel_open();
    return;
  }
  if (event.status == JobStatus::running) running_.emplace(job.rank(), event.job);
  end_if_finished(event.job, job, actions);
}

void Scheduler::on(const JobCancelled& event, TimePoint, Actions& actions) {
  Job* job = find(event.job);
  if (!job || !is_open(job->status)) return;
  end_job(event.job, *job, JobStatus::cancelled, "cancelled", actions);
}

void Scheduler::on(const JobSuperseded& event, TimePoint, Actions& actions) {
  Job* job = find(event.job);
  if (!job) return;
  const std::string& reason = event.reason;
  if (is_open(job->status)) {
    end_job(event.job, *job, JobStatus::cancelled, reason, actions);
  } else if (job->status == JobStatus::done) {
    job->status = JobStatus::cancelled;
    actions.push_back(RecordJobStatus{event.job, job->status, reason});
  }
  reopen({event.job, event.replaced}, *job, actions);
  job->tasks.cancel_open();
}

void Scheduler::on(const JobPaused& event, TimePoint, Actions& actions) {
  Job* job = find(event.job);
  if (!job || job->status != JobStatus::running) return;
  const bool waits = !event.waits.empty();
  job->waits = event.waits;
  pause_job(event.job, *job, waits ? "paused, it waits for " + event.waits : "paused", actions);
}

void Scheduler::on(const JobResumed& event, TimePoint, Actions& actions) {
  Job* job = find(event.job);
  if (!job || job->status != JobStatus::paused) return;
  job->status = JobStatus::running;
  running_.emplace(job->rank(), event.job);
  job->tasks.attempts().forget_losses();
  job->standings.forget_blind();
  job->waits.clear();
  actions.push_back(RecordJobStatus{event.job, job->status, "resumed"});
  end_if_finished(event.job, *job, actions);
}

void Scheduler::on(const TasksReopened& event, TimePoint, Actions& actions) {
  Job* job = find(event.job);
  if (!job || !is_open(job->status)) return;
  const JobGraph& graph = job->tasks.graph();
  const TaskBook& book = job->tasks.book();
  std::set<TaskIndex> named;
  RecordReopened done{event.job, {}, event.why};
  for (const TaskKey& key : event.tasks) {
    const std::optional<TaskIndex> task = graph.find(key);
    if (task) named.insert(*task);
    if (task && book.status(*task) != TaskStatus::leased) done.tasks.push_back(key);
  }
  reopen(std::move(done), *job, actions);
  for (const TaskIndex task : leases_.of_job(event.job)) {
    const bool is_stale = named.contains(task) || !book.has_inputs(task);
    if (!event.stops_leases || !is_stale) continue;
    const Lease lease = leases_.at({event.job, task});
    actions.push_back(RevokeLease{lease.worker, lease.id});
    return_lease({job, task}, lease.id, event.why, actions);
  }
}

void Scheduler::on(const FramesInspected& event, TimePoint, Actions& actions) {
  Job* job = find(event.job);
  if (!job || job->status != JobStatus::running) return;
  reopen({event.job, event.lost}, *job, actions);
  for (const TaskKey& key : event.lost) {
    const std::optional<TaskIndex> task = job->tasks.graph().find(key);
    if (task && !count_loss(event.job, *job, *task, actions)) return;
  }
  const TaskCounts& tasks = job->tasks.book().counts();
  if (tasks.open > 0 || tasks.failed > 0) return;
  if (event.strange.empty()) {
    end_job(event.job, *job, JobStatus::done, "all frames are written", actions);
  } else {
    end_job(event.job, *job, JobStatus::failed, event.strange, actions);
    job->waits = event.strange;
  }
}

void Scheduler::on(const FramesLocked& event, TimePoint, Actions& actions) {
  Job* job = find(event.job);
  if (!job || !is_open(job->status)) return;
  for (const FrameIndex frame : event.frames) {
    const std::optional<TaskIndex> task = job->tasks.graph().find(assemble_task(frame));
    if (!task) continue;
    const TaskStatus status = job->tasks.book().status(*task);
    if (status == TaskStatus::blocked || status == TaskStatus::ready)
      actions.push_back(RecordCompletion{event.job, job->tasks.leave_frame(*task, blobs_)});
  }
  end_if_finished(event.job, *job, actions);
}

void Scheduler::on(const PriorityChanged& event, TimePoint, Actions&) {
  Job* job = find(event.job);
  if (!job) return;
  const bool runs = running_.erase(job->rank()) > 0;
  job->spec.priority = event.priority;
  if (runs) running_.emplace(job->rank(), event.job);
}

void Scheduler::on(const JobForgotten& event, TimePoint, Actions&) {
  Job* job = find(event.job);
  if (!job || is_open(job->status)) return;
  job->tasks.release_all(blobs_);
  jobs_.erase(event.job);
}

// ---- events: reports ----------------------------------------------------------------------------

void Scheduler::on(const TaskCompleted& event, TimePoint now, Actions& actions) {
  if (!leases_.touch(event.worker, now)) return;
  std::vector<BlobRef> outputs = event.made.outputs;

  // A report that nobody waits for is ignored, but it must agree with what was reported before.
  const Claim claim = find_claim(event.worker, event.lease, now, actions);
  if (!claim.job) {
    const Job* job = find_job(event.lease.job);
    const auto task = job ? job->tasks.graph().find(event.lease.task) : std::nullopt;
    on(AttemptLeft{event.lease, stored_blobs(outputs)}, now, actions);
    if (!task || job->tasks.graph().check_outputs(event.lease.task, outputs)) return;
    compare_results(event, job->tasks.made().outputs(*task), outputs, actions);
    return;
  }

  // A lease that was taken up again may be an old one: what it held may have been dropped since.
  if (!leases_.at({event.lease.job, claim.task}).may_hold &&
      std::any_of(outputs.begin(), outputs.end(), [](const BlobRef& b) { return b.is_held(); })) {
    on(ResultMissing{event.worker, event.lease, outputs}, now, actions);
    return;
  }

  // An incomplete report is a failed attempt.
  const JobGraph& graph = claim.job->tasks.graph();
  const auto extent = claim.job->tasks.ledger().is_cut(claim.task) ? JobGraph::Extent::state
                                                                   : JobGraph::Extent::all;
  std::optional<std::string> fault = graph.check_outputs(event.lease.task, outputs, extent);
  if (!fault) fault = graph.check_frames(event.lease.task, event.made.frames);
  if (fault) {
    fail_attempt(claim, {event.lease, event.worker, *fault}, now, actions);
    on(AttemptLeft{event.lease, stored_blobs(outputs)}, now, actions);
    return;
  }
  // What was done before must come out alike.
  const bool is_equal =
      compare_results(event, claim.job->tasks.made().former_outputs(claim.task), outputs, actions);
  Completion completion{event.lease.task, event.made};
  completion.made.outputs = std::move(outputs);
  const bool is_shared = !leases_.at({event.lease.job, claim.task}).may_hold;
  claim.job->tasks.complete(claim.task, completion, event.worker, is_shared, blobs_);
  claim.job->sizes.learn(completion.made.outputs);
  claim.job->rests_until.at(static_cast<std::size_t>(event.lease.task.kind)) = {};
  follow_longest(claim.job->longest_seconds.at(static_cast<std::size_t>(event.lease.task.kind)),
                 event.made.stats.cpu_seconds);
  if (claim.job->status == JobStatus::running) claim.job->waits.clear();
  if (claim.job->renderer.empty()) {
    claim.job->renderer = leases_.renderer_of(event.worker);
    if (!claim.job->renderer.empty())
      actions.push_back(RecordRenderer{event.lease.job, claim.job->renderer, claim.job->is_mixed});
  }
  actions.push_back(RecordCompletion{event.lease.job, std::move(completion)});
  end_lease(event.lease.job, claim.task, LeaseEnd::done, {}, actions);
  if (is_equal) end_if_finished(event.lease.job, *claim.job, actions);
}

void Scheduler::on(const AttemptFailed& event, TimePoint now, Actions& actions) {
  const Failure& failure = event.failure;
  if (!leases_.touch(failure.worker, now)) return;
  const Claim claim = find_claim(failure.worker, failure.lease, now, actions);
  if (claim.job) fail_attempt(claim, failure, now, actions);
}

void Scheduler::on(const ResultMissing& event, TimePoint now, Actions& actions) {
  if (!leases_.touch(event.worker, now)) return;
  if (const Claim claim = find_claim(event.worker, event.lease, now, actions); claim.job) {
    claim.job->tasks.attempts().add_returned(claim.task, event.lease, event.worker);
    lose_lease(event.lease.job, claim.task, "what it made is gone", actions);
  }
  on(AttemptLeft{event.lease, stored_blobs(event.outputs)}, now, actions);
}

void Scheduler::on(const SpaceLacking& event, TimePoint now, Actions& actions) {
  if (!leases_.touch(event.worker, now)) return;
  const Claim claim = find_claim(event.worker, event.lease, now, actions);
  if (!claim.job) return;
  return_lease(claim, event.lease, event.message, actions);
  claim.job->rests_until.at(static_cast<std::size_t>(event.lease.task.kind)) = now + kRest;
  for (auto& [digest, job] : jobs_) {
    if (is_open(job.status)) job.tasks.let_between_go(blobs_);
  }
  claim.job->waits = event.message;
}

void Scheduler::on(const LeaseReturned& event, TimePoint now, Actions& actions) {
  if (!leases_.touch(event.worker, now)) return;
  if (Job* job = find(event.lease.job); job != nullptr && !event.unseen.empty())
    job->standings.add_blind(event.worker, event.unseen, now);
  const Claim claim = find_claim(event.worker, event.lease, now, actions);
  if (claim.job)
    return_lease(claim, event.lease,
                 event.unseen.empty() ? "no time left" : "does not see " + event.unseen, actions);
}

void Scheduler::on(const PlaceTaken& event, TimePoint now, Actions& actions) {
  if (!leases_.touch(event.worker, now)) return;
  const Claim claim = find_claim(event.worker, event.lease, now, actions);
  if (!claim.job) return;
  if (!event.stays) {
    return_lease(claim, event.lease, "a picture in its frame's place may be replaced", actions);
    return;
  }
  end_lease(event.lease.job, claim.task, LeaseEnd::returned, "another picture is in its place",
            actions);
  actions.push_back(
      RecordCompletion{event.lease.job, claim.job->tasks.leave_frame(claim.task, blobs_)});
  end_if_finished(event.lease.job, *claim.job, actions);
}

void Scheduler::on(const InputsLost& event, TimePoint now, Actions& actions) {
  if (!leases_.touch(event.worker, now)) return;
  const Claim claim = find_claim(event.worker, event.lease, now, actions);
  if (!claim.job) return;
  JobTasks& tasks = claim.job->tasks;
  std::vector<TaskKey> makers;
  if (tasks.ledger().is_cut(claim.task)) makers.push_back(event.lease.task);  // it will be rendered
  for (const TaskIndex input : tasks.graph().inputs(event.lease.task)) {
    const std::vector<BlobRef>& made = tasks.made().outputs(input);
    const bool lost = std::any_of(made.begin(), made.end(), [&](const BlobRef& output) {
      return std::find(event.inputs.begin(), event.inputs.end(), output) != event.inputs.end();
    });
    if (lost) makers.push_back(tasks.graph().key(input));
  }
  tasks.attempts().add_returned(claim.task, event.lease, event.worker);
  lose_lease(event.lease.job, claim.task, "its inputs are gone or damaged", actions);
  if (!is_open(claim.job->status)) return;
  RecordReopened record{event.lease.job, makers};
  if (std::ranges::any_of(event.inputs, &BlobRef::is_held))
    record.why = fmt::format("what worker {} held is gone", event.worker);
  reopen(std::move(record), *claim.job, actions);
}

void Scheduler::on(const HeldPublished& event, TimePoint now, Actions& actions) {
  if (!leases_.touch(event.worker, now)) return;
  Job* job = find(event.job);
  for (const PublishedState& state : event.states) {
    const std::optional<TaskIndex> task =
        job ? job->tasks.publish(state, event.worker, blobs_) : std::nullopt;
    if (!task) {
      blobs_.discard(state.published.digest);
      continue;
    }
    job->sizes.learn({state.published});
    actions.push_back(
        RecordOutputs{event.job, job->tasks.graph().key(*task), job->tasks.made().outputs(*task)});
  }
  asked_.erase({event.worker, event.job});
}

// ---- jobs ---------------------------------------------------------------------------------------

Scheduler::Job* Scheduler::find(const Digest& job) {
  const auto found = jobs_.find(job);
  return found == jobs_.end() ? nullptr : &found->second;
}

/// Brings a fresh job to where the journal left it, less what is gone.
void Scheduler::replay(Job& job, const JobAdded& event, Actions& actions) {
  for (const Completions::Task& done : event.completions.tasks) {
    job.sizes.learn(done.outputs);
    if (done.task.kind == TaskKind::render && !done.outputs.empty())
      job.begun_runs =
          std::clamp(done.task.run() + 1, job.begun_runs, Run(job.tasks.graph().num_runs()));
  }
  // Before it is counted who needs what.
  if (rules_.store_limit > 0 || !event.failures.empty()) job.tasks.let_between_go(blobs_);
  RecordReopened needed{event.job, {}};
  for (const TaskIndex task :
       job.tasks.restore(event.completions, event.lost_spares, blobs_, event.plan))
    needed.tasks.push_back(job.tasks.graph().key(task));
  for (const Completions::Task& former : event.former) job.tasks.remember(former);
  if (!needed.tasks.empty()) actions.push_back(std::move(needed));
  reopen({event.job, event.lost}, job, actions);
  reopen({event.job, held_by_strangers(job.tasks), "what workers held is gone"}, job, actions);
  for (const Failure& failure : event.failures) {
    const auto task = job.tasks.graph().find(failure.lease.task);
    if (!task) continue;
    job.tasks.add_failure(*task, failure, blobs_);
    if (!failure.last || !job.tasks.book().ready().contains(*task)) continue;
    job.tasks.grant(*task);
    job.tasks.give_up(*task);
  }
}

/// Opens done tasks again whose outputs are gone, and what they need.
void Scheduler::reopen(RecordReopened record, Job& job, Actions& actions) {
  for (const TaskKey& key : std::exchange(record.tasks, {})) {
    const std::optional<TaskIndex> task = job.tasks.graph().find(key);
    if (!task) continue;
    for (const TaskIndex again : job.tasks.reopen(*task, blobs_)) {
      record.tasks.push_back(job.tasks.graph().key(again));
      const std::vector<BlobRef>& former = job.tasks.made().former_outputs(again);
      if (!former.empty()) record.former.push_back({record.tasks.back(), former});
    }
  }
  if (!record.tasks.empty()) actions.push_back(std::move(record));
}

void Scheduler::fail_attempt(const Claim& claim, Failure failure, TimePoint now, Actions& actions) {
  // Of what an earlier coordinator granted nobody here knows whether it did.
  if (failure.lease.epoch != rules_.epoch) {
    return_lease(claim, failure.lease, failure.message, actions);
    return;
  }
  const Digest digest = failure.lease.job;
  Job& job = *claim.job;
  end_lease(digest, claim.task, LeaseEnd::failed, failure.message, actions);
  job.tasks.add_failure(claim.task, failure, blobs_);
  failure.last = is_exhausted(leases_.alike(job.renderer), job.tasks.attempts().blame(claim.task),
                              job.spec.max_retries_per_task);
  actions.push_back(RecordFailure{failure});

  job.standings.add_failure(failure.worker, job.spec.max_failures_per_worker, now);
  if (failure.last) {
    give_up(digest, job, claim.task, failure.message, actions);
    return;
  }
  job.tasks.give_back(claim.task);

  // Another worker should try, so nothing that it needs may be bound to this one.
  std::vector<TaskKey> bound;
  for (const TaskIndex input : job.tasks.graph().inputs(failure.lease.task)) {
    if (job.tasks.made().held_state(input) != nullptr)
      bound.push_back(job.tasks.graph().key(input));
  }
  reopen({digest, bound, "what a worker held that failed"}, job, actions);
}

/// Ends a leased task, whose lease is already dropped, as failed; and the job when that is one
/// failure too many.
void Scheduler::give_up(const Digest& digest, Job& job, TaskIndex task, const std::string& reason,
                        Actions& actions) {
  for (const TaskIndex hopeless : job.tasks.give_up(task)) revoke_lease(digest, hopeless, actions);
  if (job.tasks.book().counts().failed >= static_cast<std::uint64_t>(job.spec.max_failed_tasks)) {
    end_job(digest, job, JobStatus::failed,
            fmt::format("{} failed: {}", task_text(job, job.tasks.graph().key(task)), reason),
            actions);
  } else {
    end_if_finished(digest, job, actions);
  }
}

void Scheduler::pause_job(const Digest& digest, Job& job, const std::string& reason,
                          Actions& actions) {
  job.status = JobStatus::paused;
  running_.erase(job.rank());
  actions.push_back(RecordJobStatus{digest, job.status, reason});
}

/// A job without open tasks has ended, but for a look at its frames where none has failed.
void Scheduler::end_if_finished(const Digest& digest, Job& job, Actions& actions) {
  const TaskCounts& tasks = job.tasks.book().counts();
  const auto max_failed = static_cast<std::uint64_t>(job.spec.max_failed_tasks);
  if (tasks.open > 0 && tasks.failed < max_failed) return;
  if (tasks.failed == 0) {
    actions.push_back(InspectFrames{digest});
  } else {
    end_job(digest, job, JobStatus::failed, fmt::format("{} tasks failed", tasks.failed), actions);
  }
}

void Scheduler::end_job(const Digest& digest, Job& job, JobStatus status, const std::string& reason,
                        Actions& actions) {
  // Take back what is leased, then close whatever is open.
  for (const TaskIndex task : leases_.of_job(digest)) revoke_lease(digest, task, actions);
  job.tasks.cancel_open();
  job.tasks.let_between_go(blobs_);

  job.status = status;
  job.waits.clear();
  running_.erase(job.rank());
  actions.push_back(RecordJobStatus{digest, status, reason});
}

}  // namespace baton
