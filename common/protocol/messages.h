#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "common/base/file_stamp.h"
#include "common/base/result.h"
#include "common/job/activity.h"
#include "common/job/farm_event.h"
#include "common/job/job_id.h"
#include "common/job/task.h"
#include "common/math/pixel_rect.h"

namespace baton {

/// Every message between coordinator, workers and the command line. PROTOCOL.md describes the
/// conversation; the members of a struct, in order, are what is sent (common/base/archive.h). Bulk
/// data never travels here: blobs go through the store, messages carry their digests.

inline constexpr const char* kProtocolName = "BATON";
inline constexpr std::uint16_t kProtocolVersion = 21;

// ---- worker to coordinator ----------------------------------------------------------------------
/// The first message, sent again after a reconnect or a new epoch.
struct WorkerHello {
  std::string worker_id, host;
  /// Drawn when the process starts: who the worker is, whatever its name.
  std::uint64_t instance = 0;
  std::int32_t pid = 0, num_threads = 0;
  std::string build;  ///< build_identity()
  /// E.g. "AVX2, Embree 3.13.5": equal ones make equal bytes.
  std::string renderer;
  /// Leases of the worker, which a restarted coordinator may adopt.
  std::vector<LeaseId> running;

  /// By which it goes where another process has its name: with some digits of its instance.
  std::string own_name() const;
};
/// `count` more leases are wanted; replaces what was asked before.
struct LeaseRequest {
  std::int32_t count = 1;
};
struct Heartbeat {
  std::vector<LeaseId> running;
  bool is_draining = false;        ///< it takes nothing new, and will end
  std::uint64_t memory_bytes = 0;  ///< that the worker has; 0: not known
};
struct TaskDone {
  LeaseId lease;
  TaskOutput made;
  /// How the file of an assembled frame stood when it was written; zero: that is not known.
  FileStamp frame = {};
  /// About the job's files, for people; a worker sends each once.
  std::vector<std::string> notes = {};
};
struct TaskFailed {
  LeaseId lease;
  std::string message;
  bool permanent = false;  ///< bad input: no retry can help
  /// A disk is full: nobody's failure, waiting can help.
  bool no_space = false;
};
/// The worker will not do it: nobody's failure, and no loss.
struct LeaseReturn {
  LeaseId lease;
  /// The folder of the job that the worker cannot see; empty: it has no time left, or not_held.
  std::string unseen = {};
  /// Held inputs of the task that are not here any more: what made them must be done again.
  std::vector<BlobRef> not_held = {};
  /// Another whole picture in the place of the task's frame, and which job it names, in hexadecimal
  /// digits, if any; zero: none. It is there as it was.
  Digest in_place = {};
  std::string writer = {};
};
struct JobDocumentRequest {
  Digest job;
};
/// States that the worker held are in the store.
struct StatesPublished {
  Digest job;
  std::vector<PublishedState> states;
};
/// What an attempt put into the store that ended without a result, or too late: nobody else knows
/// of it.
struct BlobsLeft {
  LeaseId lease;
  std::vector<Digest> blobs;
};
struct WorkerGoodbye {};

// ---- coordinator to worker ----------------------------------------------------------------------
struct WorkerWelcome {
  std::uint32_t epoch = 0;
  std::int32_t heartbeat_ms = 1000;
  std::string store_directory;  ///< shared by coordinator and workers
  /// Text of the store's file `token`: whoever reads it sees the folder.
  std::string token = {};
};
using LeaseGrant = Grant;
/// Others wait for these states, which the worker holds: they should go into the store.
struct RequestStates {
  Digest job;
  std::vector<Digest> states;
};
struct LeaseRevoke {
  LeaseId lease;
};
struct NoWork {
  std::int32_t retry_ms = 200;
};
/// A TaskDone or TaskFailed of this lease has come, and what follows from it is durable.
struct ReportReceived {
  LeaseId lease;
};
struct HelloAgain {};  ///< "I do not know you": send WorkerHello
struct JobDocument {
  Digest job;
  std::string json;  ///< resolved: absolute paths, asset digests
  /// Stands in its output folder (output_token_file); empty: that could not be marked.
  std::string token = {};
  JobId id = {};  ///< of which job it is a version
};
/// Finish what is in work, take nothing new, end.
struct Drain {};
struct Shutdown {};

// ---- client to coordinator ----------------------------------------------------------------------
struct SubmitJob {
  std::string json;
  /// Frames of another picture in the output folder may be replaced.
  bool restart = false;
  /// A priority that somebody has set stays, as it is not a file that is submitted; else that of
  /// the document counts.
  bool keep_priority = false;
  /// These frames are rendered once more, although they are there.
  std::vector<FrameNumber> again = {};
};
struct ListJobs {
  bool all = false;  ///< also jobs that have ended, the newest
};
/// Names a job by its name, its ID, the digest of a version, or the unique beginning of one.
struct ShowJob {
  std::string job;
};
struct PauseJob {
  std::string job;
};
struct ResumeJob {
  std::string job;
};
/// Sent; values are for ever.
enum class WorkerOrder : std::uint8_t {
  drain = 0,  ///< to finish what it renders, and end
  /// To finish what it has, and take nothing new until it is released.
  hold = 1,
  release = 2,  ///< to take tasks again
};
constexpr WorkerOrder last_of(WorkerOrder) { return WorkerOrder::release; }
struct OrderWorker {
  std::string worker_id;
  WorkerOrder order = WorkerOrder::drain;
};
struct CancelJob {
  std::string job;
};
struct DeleteJob {
  std::string job;
};
struct StopCoordinator {};
/// Frames of a job count as done from now on, whatever is in their files; off: no longer.
struct LockFrames {
  std::string job;
  std::vector<FrameNumber> frames;  ///< ascending
  bool off = false;
};
/// The job comes before those of lower priority; its documents stay as they are.
struct SetPriority {
  std::string job;
  std::int32_t priority = 50;  ///< [0, 100]
};
/// Why a job, or a frame or tile of it, is not done, or why a worker does what it does.
struct AskWhy {
  std::string job;     ///< as of ShowJob; empty: of the worker
  std::string worker;  ///< as listed
  bool has_frame = false;
  FrameNumber frame{};
  std::int32_t tile = -1;  ///< of the frame; -1: the whole frame
};
/// What it takes to render frames of a job once more.
struct AskRequeue {
  std::string job;  ///< as of ShowJob
  std::vector<FrameNumber> frames;
};
/// Where a frame of a job can be seen.
struct AskPicture {
  std::string job;  ///< as of ShowJob
  bool has_frame = false;
  FrameNumber frame{};  ///< else the last that is written
  /// The finished tiles of one that is not; without a number the first such.
  bool partial = false;
};
/// The tasks that workers have now, and attempts that have failed since the job was submitted last.
/// job: as of ShowJob; empty: of all jobs that have not ended.
struct ListTasks {
  std::string job;
};
/// What has happened. job: as of ShowJob; empty: of all.
struct ListEvents {
  std::string job;
  EventQuery query = {};
};

// ---- coordinator to client ----------------------------------------------------------------------
/// What a version of a job has done.
struct JobSummary {
  Digest version;
  /// owner: who submitted it; empty: without a key.
  std::string name, owner, output_directory;
  JobStatus status = JobStatus::running;
  std::int32_t priority = 0;
  std::uint64_t tasks_total = 0, tasks_done = 0, tasks_leased = 0, tasks_failed = 0,
                attempts_lost = 0;
  std::uint32_t frames_total = 0, frames_done = 0;
  std::uint64_t state_bytes = 0, state_pixels = 0;  ///< all states published so far
  std::uint64_t states_held = 0;                    ///< in workers' memory alone
  std::int32_t checkpoint_every = 0;                ///< frames
  RenderStats stats;
};
struct ListedJob {
  JobIdentity identity;
  JobSummary summary;
  JobNow now = {};
};
/// A task that a worker has.
struct TaskInHand {
  JobId job;
  TaskPlace task;
  double seconds = 0;  ///< since it was granted
  UsualTime usual = {};
};
/// A folder that a worker does not see, and so gets no tasks of the job.
struct BlindSpot {
  JobId job;
  std::string folder;
};
struct WorkerSummary {
  std::string worker_id, host;
  std::int32_t pid = 0, num_threads = 0;
  std::vector<TaskInHand> tasks = {};  ///< those that it has had for longest first
  /// It was told to finish and to take nothing new.
  bool is_draining = false;
  /// It takes nothing new until it is released.
  bool is_held = false;
  std::uint64_t memory_bytes = 0;  ///< as it said last; 0: it has not
  WorkerActivity activity = WorkerActivity::idle;
  double silent_s = 0;  ///< since its last sign of life
  std::string build = {}, renderer = {};
  std::vector<BlindSpot> blind = {};
};
/// A worker that is not here, and of which people may want to know why.
struct AbsentWorker {
  std::string worker_id;
  Absence absence = Absence::lost;
  /// What was told when it joined, or asked to.
  std::string about = {};
  std::string reason = {};     ///< why it was turned away, or left
  std::int64_t joined_ms = 0;  ///< since 1970, UTC; 0: not known
  std::int64_t since_ms = 0;   ///< it was lost or left, or asked last
};
struct JobAccepted {
  JobIdentity identity;
  Digest version;
  /// An equal document: the same version goes on (a success).
  bool already_there = false;
  /// What is kept and what is done again, lines; empty: all is new.
  std::string plan = {};
};
struct JobList {
  std::vector<ListedJob> jobs;
  std::vector<WorkerSummary> workers;
  std::uint64_t num_ended = 0;  ///< jobs that have ended, listed or not
  /// Tasks of running jobs that workers may have at once.
  std::uint64_t tasks_ready = 0;
  /// CPU time of the longest recent tasks of these jobs; 0: not known.
  double task_seconds = 0;
  /// Of the last day, the newest first: workers that were turned away, and those that were lost.
  std::vector<AbsentWorker> turned_away = {}, lost = {};
};
struct JobDetail {
  JobSummary summary;
  std::vector<FrameNumber> frames_done;
  std::vector<std::string> failures;     ///< newest last, at most 100
  std::vector<FrameReport> frames = {};  ///< one for each frame so far
  std::string waits = {};                ///< for what, where it does
  /// The plan in the answer to ResumeJob, as that of JobAccepted.
  std::string plan = {};
  /// It waits for room in the store, and nothing that is in work will make some.
  bool lacks_room = false;
  std::vector<std::string> notes = {};  ///< workers' notes about the job's files
};
struct ShownJob {
  JobIdentity identity;
  JobDetail detail;
  /// Workers are connected, and all of them render otherwise than what is done was rendered.
  bool lacks_renderer = false;
  /// After each number of sweeps since its submission: the noise, and how many more there are.
  std::vector<std::string> growth = {};
  /// Frames that count as done, whatever is in their files; ascending.
  std::vector<FrameNumber> locked = {};
  JobNow now = {};
};
/// From what was asked for to its last causes; never empty.
struct ReasonChain {
  std::vector<Reason> reasons;
};
/// A task that a worker has, or an attempt that has failed.
struct ListedTask {
  JobId job;
  bool has_task = false;  ///< else the job has no such task any more
  TaskPlace task;
  std::string worker;
  bool has_failed = false;
  double seconds = 0;    ///< since it was granted, till it failed
  UsualTime usual = {};  ///< of a task in hand
  /// When it failed, since 1970, UTC; 0: it has not.
  std::int64_t time_ms = 0;
  std::string message = {};  ///< of one that has failed
};
struct TaskList {
  std::vector<ListedTask> tasks;
};
/// Events of a kind that are forgotten.
struct ForgottenEvents {
  FarmEventKind kind = FarmEventKind::coordinator_started;
  std::int64_t count = 0;
  double seconds = 0;  ///< all together
};
struct EventList {
  std::vector<FarmEvent> events;
  std::vector<ForgottenEvents> forgotten = {};  ///< of the job that was asked for
  std::string logs = {};                        ///< the folder of the workers' logs
};
/// What it takes to render frames once more.
struct RequeuePlan {
  JobIdentity identity;
  /// Tasks that are done again, for these frames and for what is needed of earlier ones.
  std::uint64_t num_tasks = 0;
  double cpu_seconds = 0;  ///< about; 0: not known
  std::string plan = {};   ///< lines
};
struct PictureSource {
  JobIdentity identity = {};
  FrameNumber frame{};
  bool is_written = false;
  std::string file = {};  ///< of a frame that is written
  /// Of the image: what viewers show, and what is rendered.
  PixelRect shown = {}, rendered = {};
  // Of one that is not:
  std::string store_directory = {};
  std::int32_t num_tiles = 0;
  std::vector<BlobRef> films = {};  ///< of the tiles that are finished
  /// What the picture is not: ", sweep 1 of 3", ", without its plate", ", as it was before ...".
  std::string note = {};
};
struct Refused {
  std::uint8_t kind = 0;  ///< ErrorKind
  std::string message;
};

/// The closed set; the index is the type code on the wire, so new messages go at the end.
using Message =
    std::variant<WorkerHello, LeaseRequest, Heartbeat, TaskDone, TaskFailed, JobDocumentRequest,
                 WorkerGoodbye, WorkerWelcome, LeaseGrant, LeaseRevoke, NoWork, HelloAgain,
                 JobDocument, Shutdown, SubmitJob, ListJobs, ShowJob, CancelJob, StopCoordinator,
                 JobAccepted, JobList, ShownJob, Refused, PauseJob, ResumeJob, OrderWorker, Drain,
                 ReportReceived, DeleteJob, LeaseReturn, StatesPublished, RequestStates, BlobsLeft,
                 ListEvents, EventList, LockFrames, SetPriority, AskWhy, ReasonChain, ListTasks,
                 TaskList, AskRequeue, RequeuePlan, AskPicture, PictureSource>;

/// The frames of one message: [protocol name and version][type][body].
std::vector<Bytes> encode_message(const Message& message);
/// Errors: wrong protocol name, another version (ErrorKind::version, names both), unknown type,
/// short or long body, past limits::kMaxMessageBytes or, of a worker, kMaxWorkerMessageBytes.
Result<Message> decode_message(const std::vector<Bytes>& frames);

}  // namespace baton
