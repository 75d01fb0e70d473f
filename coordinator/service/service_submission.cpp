#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "common/base/limits.h"
#include "common/base/paths.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/lock_keeper.h"
#include "coordinator/service/permissions.h"
#include "coordinator/service/requeue.h"
#include "coordinator/service/service.h"
#include "coordinator/service/submission.h"

namespace baton {
namespace {

/// Whether a folder can be made in that one, which is tried. A disk that is full now, or away, is
/// waited for: that is no error. Error: as the system has it.
std::error_code try_to_write(const std::filesystem::path& folder) {
  std::string probe = (folder / ".baton-XXXXXX").string();
  if (::mkdtemp(probe.data()) != nullptr) {
    ::rmdir(probe.c_str());
    return {};
  }
  const bool may_pass = errno == ENOSPC || errno == EDQUOT || errno == EIO || errno == ESTALE ||
                        errno == EMFILE || errno == ENFILE || errno == ENOMEM;
  return may_pass ? std::error_code() : std::error_code(errno, std::generic_category());
}

/// Error, io: something that is no folder stands in its place, or in that of a folder around it, or
/// nothing can be written there. Nothing is left there.
Status expect_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::path there = folder;
  while (!exists(std::filesystem::symlink_status(there, error)) && there.has_relative_path())
    there = there.parent_path();
  std::string fault = " is no folder";
  const char* what = "made";
  if (is_directory(std::filesystem::status(there, error))) {
    error = try_to_write(there);
    if (!error) return {};
    if (there == folder) what = "written";
  }
  if (error) fault = ": " + error.message();
  return Error{ErrorKind::io, fmt::format("{}: the output folder cannot be {}: {}{}",
                                          folder.string(), what, there.string(), fault)};
}

/// Error, usage: a user's key has no right to write into the folder: it lies in one that a job of
/// another user has, where it could stand in the place of frames, or in the coordinator's own, or
/// is named as what Baton keeps beside frames.
Status expect_free_place(FarmCore& farm, const Speaker& speaker, const std::string& directory) {
  const std::filesystem::path folder = resolve_folder(directory);
  const bool is_reserved = std::ranges::any_of(
      folder, [](const auto& part) { return part.string().starts_with(".baton-"); });
  if (is_reserved)
    return Error{ErrorKind::usage, directory + ": names that begin with .baton- are reserved"};
  if (speaker.name.empty() || speaker.role != Role::user) return {};
  const std::filesystem::path work = resolve_folder(farm.options.work_dir.string());
  if (lies_in(folder, work))
    return Error{ErrorKind::usage, directory + ": lies in the coordinator's work folder"};
  BATON_ASSIGN(const std::vector<Digest> around,
               farm.journal.jobs_in([&](const std::string& known) {
                 const std::filesystem::path other = resolve_folder(known);
                 return folder != other && lies_in(folder, other);
               }));
  for (const Digest& job : around) {
    if (const Status own = farm.check_own(speaker, job); !own)
      return Error{ErrorKind::usage, fmt::format("{}: lies in the output folder of another job; {}",
                                                 directory, own.error().message)};
  }
  return {};
}

/// Whether the speaker may have such a job.
Status check_rights(FarmCore& farm, const Speaker& speaker, const ParsedJobDocument& document) {
  if (const Status within = check_roots(document, farm.options.roots); !within) {
    spdlog::warn("refused: job '{}': {}", document.job.name, within.error().message);
    return within;
  }
  BATON_TRY(check_priority(speaker, document.job.priority, farm.options.user_priority));
  return expect_free_place(farm, speaker, document.job.output.directory);
}

}  // namespace

Status Service::receive(const PeerId& peer, const SubmitJob& message) {
  // Jobs that ended in this turn of the loop are read from the archive, too.
  BATON_TRY(farm_.archive_ended(files_));
  // A job that cannot be run is refused before it leaves a trace.
  BATON_ASSIGN(const bool is_unread, await_documents(peer, message, {{}, {message.json}}));
  if (is_unread) return {};
  const SharedDocument submitted = share_document(message.json);
  if (!submitted->written) return farm_.refuse(peer, submitted->written.error());
  Result<ParsedJobDocument> document = submitted->parsed;
  if (const Status may = check_rights(farm_, speaker_, *document); !may)
    return farm_.refuse(peer, may.error());
  Result<NeededDocuments> others =
      documents_in_folder(farm_.journal, document->job.output.directory);
  if (!others && others.error().kind != ErrorKind::bad_input) return others.error();
  if (!others) return farm_.refuse(peer, others.error());
  others->at_hand.push_back(submitted);
  BATON_ASSIGN(const bool has_unread, await_documents(peer, message, std::move(*others)));
  if (has_unread) return {};
  Submission submission(farm_, files_, speaker_);
  SubmitJob wanted = message;
  BATON_ASSIGN(wanted.json,
               submission.with_written_sweeps(*document, message.json, message.restart));
  if (wanted.json != message.json) document = parse_farm_document(wanted.json);
  if (!document) return farm_.refuse(peer, document.error());
  if (const std::int64_t count = count_tasks(document->job); count > limits::kMaxTasksPerJob) {
    return farm_.refuse(
        peer,
        {ErrorKind::bad_input,
         fmt::format("job {}: {} tasks, at most {}: use larger tiles or more frames per checkpoint",
                     document->job.name, count, limits::kMaxTasksPerJob)});
  }
  if (const Status folder = expect_folder(document->job.output.directory); !folder)
    return farm_.refuse(peer, folder.error());
  BATON_ASSIGN(const JobId id, submission.known_job(*document));
  BATON_TRY(LockKeeper(farm_).settle(document->job));
  if (!farm_.history.jobs().locked(id).empty()) {
    BATON_TRY(LockKeeper(farm_).tell_again(document->job, id));
  }
  const Status free = expect_no_strange_locks(document->job, farm_.history.jobs(), id);
  if (!free) return farm_.refuse(peer, free.error());
  const LockedFrames locked(document->job, farm_.history.jobs().locked(id));
  BATON_ASSIGN(const std::optional<OddFrames> odd,
               await_frames(peer, message, *document, id, locked));
  if (!odd) return {};
  for (const FramesInDoubt::Frame& frame : odd->doubt.strange) {
    const Status own = frame.writer      ? farm_.check_own(speaker_, *frame.writer)
                       : message.restart ? check_replace_unknown(speaker_)
                                         : Status();
    if (!own)
      return farm_.refuse(
          peer, {own.error().kind, fmt::format("{}: {}", frame.file, own.error().message)});
  }
  const Scheduler::Job* const known = farm_.scheduler.find_job(document->digest);
  const bool runs = known != nullptr && known->status == JobStatus::running;
  const SharedDocument newest = submission.newest_document(id);
  const std::string fault = fault_text(*odd, id, newest ? &newest->parsed->job : nullptr);
  const bool may_replace =
      message.restart && odd->doubt.locked_absent.empty() && !odd->is_locked_unreadable;
  if (!odd->unreadable.empty() && !may_replace && !runs && may_pass(document->digest))
    return farm_.refuse(peer, {ErrorKind::timeout, "waits for " + odd->unreadable});
  pass(document->digest);
  if (!fault.empty() && !may_replace && !runs)
    return farm_.refuse(peer,
                        {ErrorKind::io, fmt::format("job '{}': {}", document->job.name, fault)});
  return submission.submit(peer, *document, wanted, odd->doubt.strange);
}

/// What a submission would do that wants frames again, after all that would be in its way.
Status Service::receive(const PeerId& peer, const AskRequeue& message) {
  const Result<Digest> job = resolve_own(message.job);
  if (!job) return farm_.refuse(peer, job.error());
  BATON_ASSIGN(const SharedDocument shared, journalled_document(farm_.journal, *job));
  if (!shared->parsed) return farm_.refuse(peer, shared->parsed.error());
  BATON_ASSIGN(JournalledJob known, farm_.journal.load(*job));
  JobSpec spec = shared->parsed->job;
  spec.leading_runs = known.plan.leading_runs;
  const JobId id = farm_.history.jobs().of(*job).id;
  const LockedFrames locked = farm_.locked(*job, spec);
  const auto frames = frames_to_requeue(spec, message.frames, locked);
  if (!frames) return farm_.refuse(peer, frames.error());
  const bool is_open_now = is_open(known.status);
  Submission submission(farm_, files_, speaker_);
  if (!is_open_now) {
    const Status strange = expect_no_strange_locks(spec, farm_.history.jobs(), id);
    if (!strange) return farm_.refuse(peer, strange.error());
    BATON_ASSIGN(const std::optional<OddFrames> odd,
                 await_frames(peer, message, *shared->parsed, id, locked));
    if (!odd) return {};
    const std::string fault = fault_text(*odd, id);
    if (!fault.empty())
      return farm_.refuse(peer, {ErrorKind::io, fmt::format("job '{}': {}", spec.name, fault)});
    if (const Status is_free = submission.expect_free_folder(*shared->parsed); !is_free)
      return farm_.refuse(peer, is_free.error());
  }
  const LostFiles lost = find_lost_files({.job = *job,
                                          .spec = spec,
                                          .completions = known.completions,
                                          .failures = {},
                                          .plan = known.plan},
                                         farm_.store, files_, locked);
  if (lost.unreadable) return farm_.refuse(peer, {ErrorKind::io, *lost.unreadable});
  RequeuePlan plan = plan_requeue(spec, known, lost, *frames,
                                  is_open_now ? std::nullopt : std::optional(known.status));
  if (farm_.options.mixed_builds)
    plan.plan += "where builds are mixed, what comes out is not compared with what was there\n";
  plan.identity = farm_.history.jobs().of(*job);
  return farm_.reply(peer, std::move(plan));
}

/// The frames that a message about a job would replace or keep. nullopt: some must be read, and the
/// message waits.
Result<std::optional<OddFrames>> Service::await_frames(const PeerId& peer, const Message& message,
                                                       const ParsedJobDocument& document,
                                                       const JobId& id,
                                                       const LockedFrames& locked) {
  const TimePoint now = std::chrono::steady_clock::now();
  const Incoming incoming{peer, message, speaker_};
  const Digest& job = document.digest;
  const JobSpec& spec = document.job;
  if (waits_->join(job, incoming, now)) return std::optional<OddFrames>();
  BATON_ASSIGN(const FolderRecord record,
               FolderRecord::read(farm_.journal, farm_.history.jobs(), document, id));
  const auto* const submitted = std::get_if<SubmitJob>(&message);
  OddFrames odd = find_odd_frames(record, files_, spec, locked,
                                  /*restart=*/submitted != nullptr && submitted->restart);
  if (odd.unread.empty()) return std::optional(std::move(odd));
  const std::string text = fmt::format("job '{}': looking at {} frames in {}", spec.name,
                                       odd.unread.size(), spec.output.directory);
  spdlog::info("{}", text);
  if (!waits_->start(job, text, std::move(odd.unread), incoming, now))
    BATON_TRY(farm_.refuse(peer, {ErrorKind::timeout, text + ", after those of other jobs"}));
  return std::optional<OddFrames>();
}

}  // namespace baton
