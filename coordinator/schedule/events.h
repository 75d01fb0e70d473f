#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/job/job_spec.h"
#include "common/job/plan/sequence.h"
#include "common/job/task.h"

namespace baton {

/// The scheduler's input and output: two closed sets of plain data. Workers are
/// named by the id that they chose; any event of a worker is a sign of life.

using TimePoint = std::chrono::steady_clock::time_point;

/// A task that is done.
struct Completion {
  TaskKey task;
  TaskOutput made;
};

/// A render task that is not rendered: its states are cut and joined from those of another tiling,
/// which are of the last frame of its run.
struct Cut {
  TaskKey task;
  std::vector<BlobRef> states;

  bool operator==(const Cut&) const = default;
};

/// Where a job goes on from former jobs of its picture.
struct JobPlan {
  std::vector<Step> leading_runs;  ///< JobSpec::leading_runs
  std::vector<Cut> cuts;
  /// Frames whose files another job has written: once made again, their headers differ.
  std::vector<FrameIndex> others_frames;

  bool operator==(const JobPlan&) const = default;
};

/// All that is recorded as done of a job. A task without outputs is one of which nothing is needed
/// now (JobTasks::restore). What the tasks counted stands as sums: a job may have
/// millions of them.
struct Completions {
  struct Task {
    TaskKey task;
    std::vector<BlobRef> outputs;
  };
  std::vector<Task> tasks;
  RenderStats stats;
  std::map<Step, FrameStats> steps;         ///< what render tasks counted
  std::map<FrameIndex, FrameStats> frames;  ///< what assemblies saw

  void add(Completion completion) {
    tasks.push_back({completion.task, std::move(completion.made.outputs)});
    stats.merge(completion.made.stats);
    const bool is_frame = completion.task.kind == TaskKind::assemble;
    for (const FrameStats& of_tile : completion.made.frames)
      (is_frame ? frames[of_tile.frame()] : steps[of_tile.step()]).merge(of_tile);
  }
};

/// An attempt that failed.
struct Failure {
  LeaseId lease;
  std::string worker;
  std::string message;
  bool permanent = false;  ///< no retry by this worker can help
  bool last = false;       ///< the task has failed for good with it
};

// ---- events -------------------------------------------------------------------------------------
/// A new job, or one from the journal with what is known of it; replaces a job with this digest
/// that has ended.
struct JobAdded {
  Digest job;
  JobSpec spec;
  JobStatus status = JobStatus::running;
  Completions completions;
  std::vector<Failure> failures;
  /// Completed tasks whose outputs are gone, and cuts whose states are.
  std::vector<TaskKey> lost = {};
  /// Blobs that are gone and that nobody needs now (BlobLedger::spare_blobs).
  std::vector<BlobRef> lost_spares = {};
  /// What tasks made that are open again: it must come out alike.
  std::vector<Completions::Task> former = {};
  JobPlan plan = {};  ///< its leading runs stand in `spec`, too
  /// Of what is done of it (held_to); empty: not known.
  std::string renderer = {};
  bool is_mixed = false;   ///< others have made some of it, too
  std::string waits = {};  ///< for what, where it is paused
};
/// The renderer that may go on with what one has made, alone or not (is_mixed); nobody, where it
/// was not alone and may_take_over is not set.
inline std::string held_to(const std::string& renderer, bool is_mixed, bool may_take_over) {
  return is_mixed && !may_take_over
             ? "several builds or instruction sets (baton-coordinator --mixed-builds goes on)"
             : renderer;
}
struct JobCancelled {
  Digest job;
};
/// Another job, or a later version of it, takes the place of this one: it ends, and these frames
/// are gone; none where they are of the same picture. reason: for people, who does.
struct JobSuperseded {
  Digest job;
  std::vector<TaskKey> replaced;
  std::string reason = "another job takes its place";
};
/// No more of its tasks are granted until it is resumed; what is leased goes on.
/// waits: for what, where it is not a person who wants it so.
struct JobPaused {
  Digest job;
  std::string waits = {};
};
struct JobResumed {
  Digest job;
};
/// Done tasks of an open job are done again, whether it runs or not.
struct TasksReopened {
  Digest job;
  std::vector<TaskKey> tasks;
  std::string why = "something of them is gone";  ///< for people
  /// So are those that are leased, and what is leased of what is made of them: nobody's failure.
  bool stops_leases = false;
};
/// The files of a job's finished frames were compared with what was recorded of them. Without lost
/// frames it is all frames of the job.
struct FramesInspected {
  Digest job;
  /// Assemblies whose frames are gone or damaged.
  std::vector<TaskKey> lost = {};
  /// For people: frames that are others' now, which stay as they are; empty: none is.
  std::string strange = {};
};
/// Frames that count as done from now on, whatever is in their files; none of them is leased.
struct FramesLocked {
  Digest job;
  std::vector<FrameIndex> frames;
};
/// The job comes before those of lower priority from now on; what is leased goes on.
struct PriorityChanged {
  Digest job;
  int priority = 0;
};
/// A job that has ended is forgotten; nobody here needs its blobs any more.
struct JobForgotten {
  Digest job;
};
/// `running`: the leases that the worker has in hand, of this coordinator or an earlier one.
/// renderer: what decides the bytes that it makes; empty: it does not matter.
struct WorkerJoined {
  std::string worker;
  std::vector<LeaseId> running;
  std::string renderer = {};
};
struct WorkerAlive {
  std::string worker;
  std::vector<LeaseId> running;
};
struct WorkerLeft {
  std::string worker;
};
struct WorkRequested {
  std::string worker;
  std::int32_t count = 1;
};
struct TaskCompleted {
  std::string worker;
  LeaseId lease;
  TaskOutput made;
};
struct AttemptFailed {
  Failure failure;
};
/// The task is done as the worker says, but an output of it is not in the store: it went between
/// publishing and reporting. Nobody is to blame; the task is done again.
struct ResultMissing {
  std::string worker;
  LeaseId lease;
  std::vector<BlobRef> outputs;  ///< as it says; the others are there
};
/// An attempt failed because a disk is full, or takes nothing from anybody. Nobody is to blame: the
/// task is given back, and tasks of its kind and job rest for a while. message: what is waited for.
struct SpaceLacking {
  std::string worker;
  LeaseId lease;
  std::string message;
};
/// An attempt failed because inputs of its task are gone or damaged: what made them is done again.
struct InputsLost {
  std::string worker;
  LeaseId lease;
  std::vector<BlobRef> inputs;
};
/// States that the worker holds are in the store now; what is not held by it, or not there, is left
/// out.
struct HeldPublished {
  std::string worker;
  Digest job;
  std::vector<PublishedState> states;
};
/// The worker will not do the task: nobody's failure. unseen: what it cannot see of the job; none
/// of its tasks are granted to it for a while. Empty: it has no time left.
struct LeaseReturned {
  std::string worker;
  LeaseId lease;
  std::string unseen = {};
};
/// A picture stands in the place of the frame that the task would write, and the worker has left it
/// there. stays: it is nobody's here, so the frame counts as written, by nobody; else the task is
/// given back.
struct PlaceTaken {
  std::string worker;
  LeaseId lease;
  bool stays = true;
};
/// What an attempt put into the store that has no result, or whose lease is over.
struct AttemptLeft {
  LeaseId lease;
  std::vector<Digest> blobs;
};
/// Jobs that have ended left so much in the store.
struct StoreKeeps {
  std::uint64_t size_bytes = 0;
};
/// Time has passed: who was silent for too long?
struct ClockTicked {};

using Event =
    std::variant<JobAdded, JobCancelled, JobSuperseded, JobPaused, JobResumed, TasksReopened,
                 FramesInspected, FramesLocked, JobForgotten, PriorityChanged, WorkerJoined,
                 WorkerAlive, WorkerLeft, WorkRequested, TaskCompleted, AttemptFailed,
                 ResultMissing, SpaceLacking, InputsLost, LeaseReturned, PlaceTaken, HeldPublished,
                 AttemptLeft, StoreKeeps, ClockTicked>;

// ---- actions ------------------------------------------------------------------------------------
/// Make it durable; nothing that comes after in the same or a later step may be sent or removed
/// before.
struct RecordCompletion {
  Digest job;
  Completion completion;
};
struct RecordFailure {
  Failure failure;
};
/// What a task that is recorded as done has made lies elsewhere now.
struct RecordOutputs {
  Digest job;
  TaskKey task;
  std::vector<BlobRef> outputs;
};
/// These tasks were done and are open again; their completions are void.
struct RecordReopened {
  Digest job;
  std::vector<TaskKey> tasks;
  std::string why = "something of them is gone";  ///< for people
  /// What those of them made that must come out alike.
  std::vector<Completions::Task> former = {};
};
struct RecordJobStatus {
  Digest job;
  JobStatus status = JobStatus::running;
  std::string reason;
};

/// What is done of the job is by this renderer; others get none of its tasks.
struct RecordRenderer {
  Digest job;
  std::string renderer;
  bool is_mixed = false;  ///< others have made some of it, too
};
/// All tasks of the job are done: FramesInspected, which should follow, says whether their files
/// are still there.
struct InspectFrames {
  Digest job;
};
struct GrantLease : Grant {
  std::string worker;
};
/// How an attempt at a task ended. Every grant has one end.
enum class LeaseEnd : std::uint8_t {
  done,
  failed,
  returned,  ///< not done, and nobody's failure
  lost,      ///< its worker or its result is gone
  revoked,   ///< nobody needs it any more
};
/// For the history; the scheduler's own books are up to date.
struct TellLeaseEnd {
  LeaseId lease;
  std::string worker;
  LeaseEnd end = LeaseEnd::done;
  TimePoint granted_at;
  std::string reason;  ///< for people; may be empty
};
/// For the history: the worker goes on with a lease that had ended, or was an earlier
/// coordinator's.
struct TellLeaseTaken {
  LeaseId lease;
  std::string worker;
};
/// Somebody waits for states that the worker holds: it should put them into the store.
struct AskForStates {
  std::string worker;
  Digest job;
  std::vector<Digest> states;
};
struct RevokeLease {
  std::string worker;
  LeaseId lease;
};
/// There is less work than the worker requested; the request is kept.
struct ReportNoWork {
  std::string worker;
};
/// The worker was silent for too long and is forgotten.
struct ForgetWorker {
  std::string worker;
};
/// Two different results for one task: a bug in the renderer or a broken machine.
struct ReportConflict {
  LeaseId lease;
  std::string worker, maker;  ///< who reports, and who did first
  BlobRef expected, reported;
};
/// Nobody needs these blobs now; a later step may need one again, so ask is_referenced() and
/// is_made_again() before removing.
struct RemoveBlobs {
  std::vector<Digest> blobs;
};

using Action = std::variant<RecordCompletion, RecordOutputs, RecordFailure, RecordReopened,
                            RecordJobStatus, RecordRenderer, InspectFrames, GrantLease,
                            TellLeaseEnd, TellLeaseTaken, AskForStates, RevokeLease, ReportNoWork,
                            ForgetWorker, ReportConflict, RemoveBlobs>;

}  // namespace baton
