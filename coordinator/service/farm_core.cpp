#include "coordinator/service/farm_core.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/base/archive.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/store/folder_token.h"
#include "coordinator/schedule/waits.h"
#include "coordinator/service/diagnostics_file.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/job_report.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// After which a worker that got less than it requested may ask again.
constexpr std::int32_t kRetryMs = 250;
constexpr int kMaxFailuresShown = 100;
/// Of what a refusal says; names in it may be of any length.
constexpr std::size_t kMaxRefusalBytes = 64u << 10;

/// Frames of a job that were to be made once more, and whose files are those from before, as far as
/// can be told without reading them.
std::set<FrameIndex> former_frames(const Scheduler::Job* job, const FileTable& files) {
  std::set<FrameIndex> frames;
  for (TaskIndex task = 0; job != nullptr && task < job->tasks.graph().num_frames(); ++task) {
    const std::vector<BlobRef>& former = job->tasks.made().former_outputs(task);
    if (former.empty() || job->tasks.book().status(task) == TaskStatus::done) continue;
    const FrameIndex frame(task);
    const fs::path path = frame_path(job->spec, frame);
    const FileState state = files.judge(path, former.front()).state;
    const auto stamp = stamp_of(path);
    const bool has_size = stamp && *stamp && (*stamp)->size_bytes == former.front().size_bytes;
    if (state == FileState::right || (state == FileState::unknown && has_size))
      frames.insert(frame);
  }
  return frames;
}

}  // namespace

FarmCore::FarmCore(const ServiceOptions& with, Router messages, Journal records, BlobStore blobs,
                   std::string mark)
    : options(with),
      store_directory(fs::absolute(with.work_dir / "store").lexically_normal()),
      token(std::move(mark)),
      router(std::move(messages)),
      journal(std::move(records)),
      store(std::move(blobs)),
      scheduler({.epoch = journal.epoch(),
                 .silence_limit = with.silence_limit(),
                 .store_limit = with.store_limit,
                 .may_take_over = with.mixed_builds}),
      history(journal) {}

Status FarmCore::let_out() {
  // Before anybody hears that a job has ended.
  for (const auto& [job, mark] : std::exchange(unmarked_, {})) {
    std::error_code error;  // where it cannot be removed, it could not be written
    if (!marked_.contains(job)) fs::remove(mark, error);
  }
  for (const Outgoing& outgoing : std::exchange(outbox_, {})) {
    if (!router.send(outgoing.peer, outgoing.message))
      spdlog::debug("a peer is gone or does not read; message dropped");
  }
  return garbage.remove_some(store, [this](const Digest& blob) -> Result<bool> {
    BATON_ASSIGN(const bool is_kept, journal.is_kept(blob));
    return is_kept || scheduler.is_referenced(blob) || is_made_again(scheduler, blob);
  });
}

Status FarmCore::step(const Event& event) {
  for (const Action& action : scheduler.step(event, Clock::now())) {
    BATON_TRY(std::visit([this](const auto& a) { return perform(a); }, action));
  }
  return {};
}

// ---- answers ------------------------------------------------------------------------------------

Status FarmCore::reply(const PeerId& peer, Message message) {
  outbox_.push_back({peer, std::move(message)});
  return {};
}

Status FarmCore::reply_to(const std::string& worker, Message message) {
  const auto peer = peers.peer_of(worker);
  return peer ? reply(*peer, std::move(message)) : Status();
}

void FarmCore::reply_at(std::size_t place, const PeerId& peer, Message message) {
  outbox_.insert(outbox_.begin() + static_cast<std::ptrdiff_t>(place), {peer, std::move(message)});
}

Status FarmCore::refuse(const PeerId& peer, const Error& error) {
  return reply(peer, Refused{static_cast<std::uint8_t>(error.kind),
                             error.message.substr(0, kMaxRefusalBytes)});
}

// ---- jobs ---------------------------------------------------------------------------------------

std::string FarmCore::owner_of(const Digest& job) const {
  const auto found = owners.find(job);
  return found == owners.end() ? std::string() : found->second;
}

Status FarmCore::check_own(const Speaker& speaker, const Digest& job) const {
  if (speaker.name.empty() || speaker.role != Role::user) return {};
  const std::string owner = owner_of(job);
  if (owner == speaker.name) return {};
  return Error{
      ErrorKind::usage,
      fmt::format("job {} belongs to {}: user '{}' may not change it", history.name_of(job),
                  owner.empty() ? "nobody" : fmt::format("'{}'", owner), speaker.name)};
}

/// What versions keep that have made way for others, and jobs for which the store was too small.
Status FarmCore::let_superseded_go() {
  std::vector<Digest> versions = history.jobs().superseded();
  for (const Digest& job : std::exchange(hopeless_, {})) {
    if (scheduler.find_job(job) == nullptr) versions.push_back(job);
  }
  for (const Digest& version : versions) {
    BATON_ASSIGN(const std::vector<Digest> kept, journal.kept_blobs(version));
    if (kept.empty()) continue;
    spdlog::info("job {}: {} blobs that it has left go, as the store has no room",
                 history.name_of(version), kept.size());
    for (const Digest& blob : kept) BATON_TRY(journal.let_go(version, blob));
    garbage.add(kept);
  }
  superseded_keep_ = false;
  return {};
}

Status FarmCore::count_kept() {
  if (superseded_keep_ && options.store_limit > 0) {
    const bool lacks = std::ranges::any_of(
        scheduler.in_turn(), [&](const Digest& job) { return lacks_room(scheduler, job); });
    if (lacks) BATON_TRY(let_superseded_go());
  }
  BATON_ASSIGN(const std::uint64_t bytes, journal.kept_bytes());
  if (std::exchange(kept_bytes_, bytes) == bytes) return {};
  return step(StoreKeeps{bytes});
}

Result<JobDetail> FarmCore::living_detail(const Digest& job) {
  BATON_ASSIGN(const std::vector<Failure> failures,
               journal.recent_failures(job, kMaxFailuresShown));
  JobDetail detail = describe_job(scheduler, job, failures);
  if (const auto found = notes.find(job); found != notes.end()) detail.notes = found->second;
  return detail;
}

Result<std::optional<JobDetail>> FarmCore::archived_detail(const Digest& job) {
  return baton::archived_detail(journal, job, history.name_of(job));
}

Result<bool> FarmCore::ended_by_frames(const Digest& job, const std::string& reason,
                                       const std::vector<FrameNumber>* unlocked) {
  BATON_ASSIGN(std::optional<JobDetail> detail, archived_detail(job));
  if (!detail) return false;
  JobSummary& summary = detail->summary;
  const bool has_failed = summary.status == JobStatus::failed && summary.tasks_failed == 0;
  const bool was_done = summary.status == JobStatus::done;
  const std::set<FrameNumber> has(detail->frames_done.begin(), detail->frames_done.end());
  const bool done_counts =
      unlocked != nullptr &&
      std::ranges::all_of(*unlocked, [&](FrameNumber frame) { return has.contains(frame); });
  if (!has_failed && !(was_done && done_counts)) return false;
  if (reason.empty()) return true;
  if (was_done) {
    summary.status = JobStatus::failed;
    BATON_TRY(history.status_changed(job, summary.status, reason));
  }
  detail->waits = reason;
  BATON_TRY(journal.describe_archived(job, summary.status, to_bytes(summary), to_bytes(*detail)));
  return true;
}

Status FarmCore::archive_ended(const FileTable& files) {
  for (const Digest& job : std::exchange(ended_, {}))
    BATON_TRY(archive_job(job, former_frames(scheduler.find_job(job), files)));
  return {};
}

Status FarmCore::archive_job(const Digest& digest, const std::set<FrameIndex>& stand) {
  const Scheduler::Job* const job = scheduler.find_job(digest);
  if (job == nullptr || is_open(job->status)) return {};
  superseded_keep_ = true;
  if (job->is_hopeless) hopeless_.insert(digest);
  std::vector<BlobRef> kept;
  for (TaskIndex task = job->tasks.graph().num_frames(); task < job->tasks.graph().num_tasks();
       ++task) {
    for (const auto& blobs : {job->tasks.ledger().live_blobs(job->tasks.view(), task),
                              job->tasks.ledger().spare_blobs(job->tasks.view(), task)}) {
      for (const BlobRef& blob : blobs) {
        if (!blob.is_held()) kept.push_back(blob);
      }
    }
    if (job->tasks.ledger().is_cut(task)) {
      for (const BlobRef& blob : job->tasks.ledger().inputs(job->tasks.view(), task))
        kept.push_back(blob);
    }
  }
  BATON_ASSIGN(JobDetail detail, living_detail(digest));
  for (const FrameIndex frame : stand) {
    const TaskIndex task = *job->tasks.graph().find(assemble_task(frame));
    BATON_TRY(journal.record_completion(
        digest, {assemble_task(frame), {.outputs = job->tasks.made().former_outputs(task)}}));
  }
  if (!stand.empty()) detail.frames_done = finished_frames(*job, stand);
  detail.summary.frames_done += static_cast<std::uint32_t>(stand.size());
  detail.summary.tasks_done += stand.size();
  BATON_TRY(journal.archive_job(digest, to_bytes(detail.summary), to_bytes(detail), kept));
  lost_before.erase(digest);
  notes.erase(digest);
  return step(JobForgotten{digest});
}

// ---- what the scheduler decides, carried out ----------------------------------------------------

Status FarmCore::perform(const RecordCompletion& action) {
  return journal.record_completion(action.job, action.completion);
}

Status FarmCore::perform(const RecordOutputs& action) {
  return journal.record_outputs(action.job, action.task, action.outputs);
}

Status FarmCore::perform(const RecordFailure& action) {
  const Failure& failure = action.failure;
  const Scheduler::Job* const job = scheduler.find_job(failure.lease.job);
  spdlog::warn("job {}: {}, attempt {} on {} failed: {}", history.name_of(failure.lease.job),
               job ? task_text(*job, failure.lease.task) : "a task", failure.lease.attempt,
               failure.worker, failure.message);
  return journal.record_failure(failure);
}

Status FarmCore::perform(const RecordReopened& action) {
  spdlog::warn("job {}: {}", history.name_of(action.job), reopened_text(action));
  BATON_TRY(history.reopened(action));
  return journal.record_reopened(action.job, action.tasks, action.former);
}

Status FarmCore::perform(const RecordJobStatus& action) {
  const auto level = action.status == JobStatus::failed ? spdlog::level::err : spdlog::level::info;
  spdlog::log(level, "job {}: {}", history.name_of(action.job), action.reason);
  BATON_TRY(history.status_changed(action.job, action.status, action.reason));
  // Before the status is durable: whoever is killed in between ends the job, and writes, again.
  const Scheduler::Job* job = scheduler.find_job(action.job);
  if (job != nullptr && !is_open(action.status) && check_output_root(job->spec, options.roots)) {
    const Status written = write_diagnostics(journal, action.job, job->spec, options.roots);
    if (!written) spdlog::warn("no diagnostics: {}", written.error().message);
  }
  remove_job_file(action.job, action.status);
  if (job != nullptr && !is_open(action.status)) {
    unmarked_[action.job] = output_token_file(job->spec.output.directory, action.job, token);
    marked_.erase(action.job);
    BATON_TRY(journal.record_output_mark(action.job, std::nullopt));
  }
  // Workers that have its document from before do not ask for it again.
  if (action.status == JobStatus::running && !marked_.contains(action.job))
    BATON_TRY(mark_output(action.job));
  if (!is_open(action.status)) {
    ended_.push_back(action.job);
    records_.erase(action.job);
  }
  return journal.record_status(action.job, action.status);
}

Status FarmCore::perform(const RecordRenderer& action) {
  return journal.record_renderer(action.job, action.renderer, action.is_mixed);
}

Status FarmCore::perform(const InspectFrames& action) {
  to_inspect.emplace(action.job, Clock::now());
  return {};
}

Status FarmCore::perform(const GrantLease& action) {
  Grant grant = action;
  if (grant.lease.task.kind == TaskKind::assemble) {
    BATON_ASSIGN(grant.may_replace, replaceable(grant.lease));
    // From now on its file may be there, reported or not.
    BATON_TRY(journal.record_frame_file(grant.lease.job, grant.lease.task.frame(), FrameFile{}));
  }
  BATON_TRY(history.granted(*scheduler.find_job(grant.lease.job), grant.lease, action.worker));
  return reply_to(action.worker, grant);
}

Status FarmCore::perform(const TellLeaseEnd& action) {
  return history.lease_ended(scheduler.find_job(action.lease.job), action);
}

Status FarmCore::perform(const TellLeaseTaken& action) {
  return history.granted(*scheduler.find_job(action.lease.job), action.lease, action.worker,
                         "goes on with it");
}

Status FarmCore::perform(const AskForStates& action) {
  return reply_to(action.worker, RequestStates{action.job, action.states});
}

Status FarmCore::perform(const RevokeLease& action) {
  return reply_to(action.worker, LeaseRevoke{action.lease});
}

Status FarmCore::perform(const ReportNoWork& action) {
  return reply_to(action.worker, NoWork{kRetryMs});
}

Status FarmCore::perform(const ForgetWorker& action) {
  spdlog::warn("worker {} is silent: its leases go to others", action.worker);
  peers.remove(action.worker);
  return history.happened(FarmEventKind::worker_lost, action.worker);
}

Status FarmCore::perform(const ReportConflict& action) {
  spdlog::error(
      "BUG: job {}: {}: worker {} reports {} for frame index {}, tile {}, but worker {} has "
      "reported {}",
      history.name_of(action.lease.job), describe_task(action.lease.task), action.worker,
      action.reported.digest.hex(), action.reported.position, action.reported.tile, action.maker,
      action.expected.digest.hex());
  return {};
}

Status FarmCore::perform(const RemoveBlobs& action) {
  garbage.add(action.blobs);
  return {};
}

// ---- what stands in the places of frames --------------------------------------------------------

Result<FolderRecord*> FarmCore::record_of(const Digest& job) {
  const auto known = records_.find(job);
  if (known != records_.end()) return &known->second;
  BATON_ASSIGN(FolderRecord record, FolderRecord::read(journal, history.jobs(), job));
  return &records_.emplace(job, std::move(record)).first->second;
}

/// Of an assembly of a job that the scheduler has; none where nothing is in the frame's place.
Result<std::vector<Digest>> FarmCore::replaceable(const LeaseId& lease) {
  const JobSpec& spec = scheduler.find_job(lease.job)->spec;
  const fs::path path = frame_path(spec, lease.task.frame());
  const Result<std::optional<FileStamp>> stamp = stamp_of(path);
  if (stamp && !*stamp) return std::vector<Digest>();
  BATON_ASSIGN(FolderRecord* const record, record_of(lease.job));
  return record->replaceable(path);
}

Result<bool> FarmCore::may_replace(const Digest& job, const fs::path& path,
                                   const FileVerdict& picture) {
  records_.erase(job);
  BATON_ASSIGN(FolderRecord* const record, record_of(job));
  if (!record->may_replace(path, picture)) return false;
  record->give_up(path, picture.digest);
  return true;
}

Status FarmCore::give_up(const Digest& job, const std::vector<FramesInDoubt::Frame>& frames) {
  records_.erase(job);
  const JobId id = history.jobs().of(job).id;
  for (const FramesInDoubt::Frame& frame : frames)
    BATON_TRY(journal.record_given_up(id, fs::path(frame.file).filename().string(), frame.digest));
  return {};
}

Status FarmCore::take_back(const JobId& id,
                           const std::function<bool(const std::string& file)>& which) {
  for (const Digest& version : history.jobs().versions(id)) records_.erase(version);
  BATON_ASSIGN(const auto given_up, journal.given_up(id));
  for (const auto& [file, picture] : given_up) {
    if (which(file)) BATON_TRY(journal.record_given_up(id, file, std::nullopt));
  }
  return {};
}

// ---- marks of folders ---------------------------------------------------------------------------

void FarmCore::keep_token() const {
  const fs::path file = store_directory / "token";
  if (expect_token(file, token)) return;
  const Status written = write_token(file, token);
  spdlog::warn("{}", written ? file.string() + ": was gone or changed and is written again"
                             : written.error().message);
}

Status FarmCore::take_up_marks() {
  BATON_ASSIGN(marked_, journal.output_marks());
  return {};
}

Result<std::string> FarmCore::mark_output(const Digest& job) {
  const Scheduler::Job* const open = scheduler.find_job(job);
  if (open == nullptr || !is_open(open->status)) return std::string();
  const fs::path file = output_token_file(open->spec.output.directory, job, token);
  const std::string frames = format_frames(locked(job, open->spec).numbers(open->spec));
  const Result<std::string> there = read_after_token(file, token);
  if (marked_.contains(job) && (lost_mark(job, open->spec) || (there && *there == frames)))
    return token;
  if (!check_output_root(open->spec, options.roots)) return std::string();
  if (const Status written = write_token(file, token, frames, options.roots); !written) {
    spdlog::warn("job {}: its output folder is not marked: {}", history.name_of(job),
                 written.error().message);
    return std::string();
  }
  marked_.insert(job);
  BATON_TRY(journal.record_output_mark(job, resolve_folder(open->spec.output.directory)));
  return token;
}

Status FarmCore::mark_output_again(const Digest& job) {
  if (marked_.erase(job) == 0) return {};
  const Result<std::string> marked = mark_output(job);
  marked_.insert(job);  // one that cannot be written is lost still
  return marked ? Status() : marked.error();
}

std::optional<std::string> FarmCore::lost_mark(const Digest& job, const JobSpec& spec) const {
  if (!marked_.contains(job)) return std::nullopt;
  const fs::path folder = spec.output.directory;
  const fs::path file = output_token_file(folder, job, token);
  const Result<bool> is_ours = has_token(file, token);
  if (!is_ours || *is_ours) return std::nullopt;
  std::error_code error;
  if (!fs::is_directory(folder, error))
    return fmt::format("{}: the output folder is not there", folder.string());
  return fmt::format(
      "{}: not the output folder that the job has written to: {} {}", folder.string(),
      file.filename().string(),
      fs::exists(fs::symlink_status(file, error)) ? "in it is another's" : "is gone from it");
}

void FarmCore::remove_job_file(const Digest& job, JobStatus status) {
  if (status != JobStatus::done && status != JobStatus::cancelled) return;
  std::error_code error;
  fs::remove(store.job_file(job), error);
  if (error) spdlog::warn("{}: cannot remove: {}", store.job_file(job).string(), error.message());
}

}  // namespace baton
