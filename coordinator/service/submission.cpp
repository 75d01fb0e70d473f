#include "coordinator/service/submission.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include "common/base/archive.h"
#include "common/base/limits.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/neighbour.h"
#include "coordinator/service/plan_text.h"
#include "coordinator/service/requeue.h"

namespace baton {

namespace {

/// What --restart cannot decide while nobody is connected; empty: it has decided.
std::string undecided_text(const Scheduler& scheduler, const Digest& job) {
  const std::string& renderer = scheduler.find_job(job)->renderer;
  if (renderer.empty() || !scheduler.leases().connected().empty()) return {};
  return fmt::format(
      "no worker is connected: for those that do not render with {} --restart is needed once more",
      renderer);
}

}  // namespace

// ---- another job of the folder ------------------------------------------------------------------

/// What the journal knows of the jobs of a folder that can be read, in the order of submission, as
/// far as a later one can use it. They write into it by that name, whichever they have for it.
Result<std::vector<Submission::InFolder>*> Submission::jobs_in(const std::string& folder) {
  const auto [entry, is_new] = folders_.try_emplace(folder);
  if (!is_new) return &entry->second;
  BATON_ASSIGN(const std::vector<Digest> jobs, jobs_in_folder(farm_.journal, folder));
  for (const Digest& job : jobs) {
    BATON_ASSIGN(JournalledJob known, farm_.journal.load(job));
    BATON_ASSIGN(const SharedDocument document, journalled_document(farm_.journal, job));
    if (!document->parsed) continue;
    FormerJob former{
        *document->parsed, std::move(known.completions.tasks),  std::move(known.plan),
        known.status,      std::move(known.completions.frames), std::move(known.renderer),
        known.is_mixed};
    former.document.job.leading_runs = former.plan.leading_runs;
    former.document.job.output.directory = folder;
    entry->second.push_back({job, std::move(former)});
  }
  return &entry->second;
}

/// The one that had the document before, else the one of its name in its folder that is the
/// speaker's own, or the newest that an administrator may change.
Result<JobId> Submission::known_job(const ParsedJobDocument& document) {
  const IdentityBook& known = farm_.history.jobs();
  if (const JobId before = known.of(document.digest).id; !before.empty()) return before;
  BATON_ASSIGN(const std::vector<Digest> namesakes,
               jobs_in_folder(farm_.journal, document.job.output.directory, document.job.name));
  const auto newest = [&](const auto& is_meant) {
    const auto found = std::ranges::find_if(
        namesakes.rbegin(), namesakes.rend(),
        [&](const Digest& v) { return is_meant(v) && !known.of(v).id.empty(); });
    return found == namesakes.rend() ? JobId() : known.of(*found).id;
  };
  const JobId own = newest([&](const Digest& v) { return farm_.owner_of(v) == speaker_.name; });
  const bool may_change_all = !speaker_.name.empty() && speaker_.role == Role::admin;
  return !own.empty() || !may_change_all ? own : newest([](const Digest&) { return true; });
}

Status Submission::expect_free_folder(const ParsedJobDocument& document) {
  BATON_ASSIGN(const JobId id, known_job(document));
  const Result<std::vector<Neighbour>> others = find_neighbours(document, id, false);
  return others ? Status() : Status(others.error());
}

/// What stands in the way of a new version of `job`: a folder has one open job, and a frame in it
/// belongs to the job that wrote it. Errors (bad_input, usage): jobs of another picture whose
/// frames would be replaced, without `restart`; another job that is open.
Result<std::vector<Neighbour>> Submission::find_neighbours(const ParsedJobDocument& document,
                                                           const JobId& job, bool restart) {
  std::vector<Neighbour> others;
  BATON_ASSIGN(const auto* neighbours, jobs_in(document.job.output.directory));
  const FramesByFile frames(document);
  for (const auto& [digest, former] : *neighbours) {
    if (digest == document.digest) continue;
    BATON_ASSIGN(const std::optional<JobDetail> ended, farm_.archived_detail(digest));
    const JobIdentity who = farm_.history.jobs().of(digest);
    const bool is_former_version = who.id == job;
    const Locks locks{is_former_version
                          ? LockedFrames()
                          : LockedFrames(former.document.job, farm_.history.jobs().locked(who.id)),
                      LockedFrames(document.job, farm_.history.jobs().locked(job))};
    Neighbour other =
        look_at(former, digest, frames, files_, ended ? &ended->frames_done : nullptr, locks);
    // What is only to be looked at makes way for the next look.
    const bool may_replace =
        restart || (document.job.output.is_look && former.document.job.output.is_look);
    if (other.busy && !may_replace && !is_former_version) {
      return Error{
          ErrorKind::bad_input,
          fmt::format("job '{}': job {} ('{}', {}) writes into {}: wait for its end, cancel "
                      "it (--restart does), or choose another output.directory",
                      document.job.name, farm_.history.name_of(digest), former.document.job.name,
                      job_status_name(other.status), document.job.output.directory)};
    }
    // A folder with a job has an owner: diagnostics and the marks are one for all in it.
    if (const Status own = farm_.check_own(speaker_, digest); !own)
      return Error{ErrorKind::usage, own.error().message + "; another output.directory keeps it"};
    if (!other.locked.empty())
      return locked_elsewhere(document.job, other.locked, farm_.history.name_of(digest),
                              other.locked);
    if (!other.differing.empty() && !may_replace)
      return another_picture(document.job, other, former.document.job,
                             farm_.history.name_of(digest));
    if (other.written.empty() && !other.busy) continue;
    others.push_back(std::move(other));
  }
  return others;
}

/// Jobs of the same picture end and leave their work; those of another one end, too. Returns lines
/// that say what is replaced, and why.
Result<std::vector<std::string>> Submission::make_way(const ParsedJobDocument& document,
                                                      const std::vector<Neighbour>& others) {
  std::vector<std::string> reasons;
  const std::string name = farm_.history.name_of(document.digest);
  for (const Neighbour& other : others) {
    const std::string other_name = farm_.history.name_of(other.job);
    if (is_open(other.status)) {
      if (other_name != name) spdlog::info("job {} makes way for job {}", other_name, name);
      const IdentityBook& known = farm_.history.jobs();
      BATON_TRY(farm_.step(JobSuperseded{
          other.job,
          {},
          other_name == name
              ? fmt::format("version {} goes on in place of version {}",
                            known.of(document.digest).version, known.of(other.job).version)
              : fmt::format("job {} writes its frames from now on", name)}));
      BATON_TRY(farm_.archive_job(other.job));
      if (!other.left_out.empty())
        reasons.push_back(
            fmt::format("frames {} of {} are not rendered any more", format_frames(other.left_out),
                        other_name == name ? "the version before" : "job " + other_name));
    }
    if (other.differing.empty()) continue;
    BATON_TRY(disown(other.job, other.written, name));
    reasons.push_back(fmt::format(
        "{} of job {} {} replaced: {} differs", other.written.size() == 1 ? "a frame" : "frames",
        other_name, other.written.size() == 1 ? "is" : "are", differing_text(other.differing)));
  }
  return reasons;
}

/// Takes frames that another picture replaces off those that a job in the archive has. What it was
/// when it ended stays as it is.
Status Submission::disown(const Digest& job, const std::vector<FrameNumber>& frames,
                          const std::string& by) {
  BATON_ASSIGN(std::optional<JobDetail> detail, farm_.archived_detail(job));
  if (!detail) return {};
  std::vector<FrameNumber> replaced;
  std::erase_if(detail->frames_done, [&](FrameNumber frame) {
    const bool is_gone = std::ranges::find(frames, frame) != frames.end();
    if (is_gone) replaced.push_back(frame);
    return is_gone;
  });
  if (replaced.empty()) return {};
  detail->notes.push_back(
      fmt::format("job {} has replaced frames {}", by, format_frames(replaced)));
  return farm_.journal.describe_archived(job, detail->summary.status, to_bytes(detail->summary),
                                         to_bytes(*detail));
}

// ---- submission ---------------------------------------------------------------------------------

Status Submission::submit(const PeerId& peer, const ParsedJobDocument& document,
                          const SubmitJob& message,
                          const std::vector<FramesInDoubt::Frame>& strange) {
  const Scheduler::Job* const known = farm_.scheduler.find_job(document.digest);
  const bool is_new = farm_.history.jobs().of(document.digest).id.empty();
  if (const Status own = farm_.check_own(speaker_, document.digest); !is_new && !own)
    return farm_.refuse(peer, own.error());
  const Result<std::set<FrameIndex>> again =
      frames_to_requeue(document.job, message.again, farm_.locked(document.digest, document.job));
  if (!again) return farm_.refuse(peer, again.error());
  again_ = *again;
  // What cannot go on, since nobody renders as it was rendered, begins again.
  const bool begins_again = known != nullptr && message.restart &&
                            farm_.scheduler.leases().nobody_renders_as(known->renderer);
  if (begins_again) {
    BATON_TRY(farm_.step(JobSuperseded{
        document.digest, {}, "it begins again, as nobody renders as it was rendered"}));
    BATON_TRY(farm_.archive_job(document.digest));
  } else if (known != nullptr) {
    if (message.restart) BATON_TRY(farm_.give_up(document.digest, strange));
    BATON_TRY(begin_growth(document, message.restart));
    if (!message.keep_priority) BATON_TRY(take_priority(document));
    BATON_TRY(tell_requeue(document));
    return go_on(peer, document.digest, message.restart);
  }

  if (farm_.scheduler.num_jobs() >= limits::kMaxJobs) {
    return farm_.refuse(
        peer, {ErrorKind::io,
               fmt::format("the farm is full: {} jobs that have not ended", limits::kMaxJobs)});
  }
  BATON_ASSIGN(JobId id, known_job(document));
  if (id.empty()) id = JobId::draw();
  const Result<std::vector<Neighbour>> others = find_neighbours(document, id, message.restart);
  if (!others) {
    const ErrorKind kind = others.error().kind;
    if (kind != ErrorKind::bad_input && kind != ErrorKind::usage) return others.error();
    return farm_.refuse(peer, others.error());
  }
  const LockedFrames locked(document.job, farm_.history.jobs().locked(id));
  if (const Status by_one = message.restart ? Status() : expect_by_one(document, locked); !by_one)
    return farm_.refuse(peer, by_one.error());
  std::string changes = changes_text(document, id, message.keep_priority);
  if (message.restart) changes = changes.empty() ? "restart" : "restart; " + changes;
  if (!again_.empty()) changes = "frames are wanted again";
  // Nobody has asked for what is looked at again after an unlock.
  BATON_TRY(farm_.history.submitted(document.digest, id, changes, !peer.empty()));
  if (!message.keep_priority)
    BATON_TRY(farm_.history.forget_priority(document.digest, document.job.priority));
  if (message.restart) BATON_TRY(farm_.give_up(document.digest, strange));
  BATON_TRY(tell_requeue(document));
  const std::set<std::string> files = frame_files(document.job, document.job.frames);
  BATON_TRY(farm_.take_back(id, [&](const std::string& file) { return !files.contains(file); }));
  BATON_TRY(begin_growth(document, message.restart));
  BATON_ASSIGN(std::vector<std::string> reasons, make_way(document, *others));
  return begin(peer, document, message, std::move(reasons));
}

Status Submission::tell_requeue(const ParsedJobDocument& document) {
  if (again_.empty()) return {};
  std::vector<FrameNumber> frames;
  for (const FrameIndex frame : again_) frames.push_back(document.job.frames[frame.index()]);
  return farm_.history.requeued(document.digest, frames);
}

/// What has made frames that are to be rendered once more, or makes them now, is done again.
Status Submission::requeue(const Digest& version) {
  if (again_.empty()) return {};
  const JobTasks& tasks = farm_.scheduler.find_job(version)->tasks;
  std::vector<TaskKey> again = tasks_of_frames(tasks.graph(), again_);
  std::erase_if(again, [&](const TaskKey& key) {
    const std::optional<TaskIndex> task = tasks.graph().find(key);
    const TaskStatus status = task ? tasks.book().status(*task) : TaskStatus::blocked;
    return status != TaskStatus::done && status != TaskStatus::leased;
  });
  return farm_.step(TasksReopened{version, std::move(again), "somebody wants them again",
                                  /*stops_leases=*/true});
}

SharedDocument Submission::newest_document(const JobId& job) {
  const std::vector<Digest> versions = farm_.history.jobs().versions(job);
  if (versions.empty()) return nullptr;
  const Result<SharedDocument> newest = journalled_document(farm_.journal, versions.back());
  return newest && (*newest)->parsed ? *newest : nullptr;
}

/// What the document makes another of a job that is known; empty: nothing.
std::string Submission::changes_text(const ParsedJobDocument& document, const JobId& job,
                                     bool keep_priority) {
  const SharedDocument newest = newest_document(job);
  if (newest == nullptr) return {};
  const JobSpec& before = newest->parsed->job;
  std::vector<std::string> changes;
  const auto compare = [&](const char* what, auto is, auto was) {
    if (is != was) changes.push_back(fmt::format("{} {}, it was {}", what, is, was));
  };
  const IdentityBook& known = farm_.history.jobs();
  const std::int32_t written = document.job.priority;
  compare("frames", format_frames(document.job.frames), format_frames(before.frames));
  compare("priority", keep_priority ? known.priority(job, written) : written,
          known.priority(job, before.priority));
  std::vector<std::string> others = picture_differences(*newest->parsed, document);
  std::ranges::move(setting_differences(before, document.job), std::back_inserter(others));
  if (!others.empty()) changes.push_back("changed: " + differing_text(others));
  return fmt::format("{}", fmt::join(changes, "; "));
}

/// The document of an open job is submitted again, and its priority holds again.
Status Submission::take_priority(const ParsedJobDocument& document) {
  const std::int32_t before = farm_.scheduler.find_job(document.digest)->spec.priority;
  const std::int32_t written = document.job.priority;
  BATON_TRY(farm_.history.forget_priority(document.digest, written));
  if (before == written) return {};
  BATON_TRY(farm_.history.prioritized(document.digest, before, {written, written},
                                      ": its file was submitted again"));
  return farm_.step(PriorityChanged{document.digest, written});
}

/// Starts a job with all that former ones of its picture leave to it.
Status Submission::begin(const PeerId& peer, const ParsedJobDocument& document,
                         const SubmitJob& message, std::vector<std::string> reasons) {
  const Digest digest = document.digest;
  const LockedFrames locked = farm_.locked(digest, document.job);
  BATON_ASSIGN(const Heritage heritage, find_heritage(document, message.restart, locked, reasons));

  JobAdded event{digest, document.job, JobStatus::running, {}, {}};
  event.spec.priority =
      farm_.history.jobs().priority(farm_.history.jobs().of(digest).id, document.job.priority);
  BATON_ASSIGN(const std::optional<std::string> known, farm_.journal.document(digest));
  BATON_TRY(take_over(heritage, known ? "" : message.json, event));
  const auto had_others = [&](const Digest& former) {
    const Result<SharedDocument> before = journalled_document(farm_.journal, former);
    return before && (*before)->parsed &&
           (*before)->parsed->job.state.checkpoint_every != event.spec.state.checkpoint_every;
  };
  if (carries_state(event.spec) && !event.plan.leading_runs.empty() &&
      std::ranges::any_of(heritage.formers, had_others))
    reasons.push_back(
        fmt::format("runs that were begun stay as they are; state.checkpointEvery, {}, holds for "
                    "those after them",
                    event.spec.state.checkpoint_every));
  LostFiles lost = find_lost_files(event, farm_.store, files_, locked);
  const bool is_right = event.lost.empty() && lost.all_frames_right();
  for (std::string& reason : lost_reasons(lost)) {
    if (std::find(reasons.begin(), reasons.end(), reason) == reasons.end())
      reasons.push_back(std::move(reason));
  }
  event.lost.insert(event.lost.end(), lost.tasks.begin(), lost.tasks.end());
  event.lost_spares = std::move(lost.spares);
  if (std::string kept = locked_text(document.job, locked); !kept.empty())
    reasons.push_back(std::move(kept));

  // The answer goes out before any lease of the job.
  const std::size_t place = farm_.num_replies();
  BATON_TRY(farm_.step(event));
  BATON_TRY(requeue(digest));
  if (std::string line = undecided_text(farm_.scheduler, digest); message.restart && !line.empty())
    reasons.push_back(std::move(line));
  const Scheduler::Job& job = *farm_.scheduler.find_job(digest);
  const TaskCounts& tasks = job.tasks.book().counts();
  const bool has_all = is_right && tasks.open == 0 && tasks.failed == 0;
  if (!has_all) BATON_TRY(farm_.mark_output(digest));
  const std::string plan = plan_text(job, reasons);
  const bool already_there = known && has_all;
  if (!peer.empty())
    farm_.reply_at(place, peer,
                   JobAccepted{farm_.history.jobs().of(digest), digest, already_there, plan});
  const std::string name = farm_.history.name_of(digest);
  spdlog::info("job {} {}: '{}', {} of {} tasks are done", name, known ? "goes on" : "submitted",
               job.spec.name, job.tasks.progress().tasks_done, job.tasks.progress().tasks_total);
  if (!plan.empty()) spdlog::info("job {}: {}", name, plan);

  // Blobs that the new job needs are not kept for the former ones any more.
  for (const Digest& former : heritage.formers) {
    BATON_ASSIGN(const std::vector<Digest> kept, farm_.journal.kept_blobs(former));
    for (const Digest& blob : kept) {
      if (farm_.scheduler.is_referenced(blob)) BATON_TRY(farm_.journal.let_go(former, blob));
    }
  }
  return has_all ? finish(digest) : Status();
}

Status Submission::finish(const Digest& version) {
  BATON_ASSIGN(const bool grows, grow(version));
  return grows ? Status() : farm_.step(FramesInspected{version});
}

/// A job that has not ended is submitted again. A paused one goes on, and what is gone or damaged
/// is made again; where that cannot be told, it stays paused, unless all may be made again.
Status Submission::go_on(const PeerId& peer, const Digest& digest, bool restart) {
  BATON_ASSIGN(LostFiles lost, lost_files_of(digest, restart));
  if (lost.unreadable) {
    BATON_TRY(farm_.step(JobPaused{digest, *lost.unreadable}));
    return farm_.refuse(
        peer, {ErrorKind::io, fmt::format("job {} is paused: {}", farm_.history.name_of(digest),
                                          *lost.unreadable)});
  }
  if (restart) BATON_TRY(farm_.mark_output_again(digest));
  const bool runs = farm_.scheduler.find_job(digest)->status == JobStatus::running;
  std::vector<std::string> reasons = lost_reasons(lost);
  const auto noted = farm_.lost_before.find(digest);
  if (reasons.empty() && noted != farm_.lost_before.end()) reasons = noted->second;
  const JobSpec& spec = farm_.scheduler.find_job(digest)->spec;
  if (std::string kept = locked_text(spec, farm_.locked(digest, spec)); restart && !kept.empty())
    reasons.push_back(std::move(kept));
  if (std::string line = undecided_text(farm_.scheduler, digest); restart && !line.empty())
    reasons.push_back(std::move(line));
  const std::size_t place = farm_.num_replies();
  BATON_TRY(farm_.step(TasksReopened{digest, std::move(lost.tasks)}));
  BATON_TRY(requeue(digest));
  // One whose frames are wanted again stays paused.
  if (!runs && again_.empty()) BATON_TRY(farm_.step(JobResumed{digest}));
  const std::string plan = plan_text(*farm_.scheduler.find_job(digest), reasons);
  farm_.reply_at(place, peer, JobAccepted{farm_.history.jobs().of(digest), digest, true, plan});
  return {};
}

Result<LostFiles> Submission::lost_files_of(const Digest& job, bool restart) {
  BATON_ASSIGN(JournalledJob known, farm_.journal.load(job));
  const JobSpec& spec = farm_.scheduler.find_job(job)->spec;
  LostFiles lost = find_lost_files({.job = job,
                                    .spec = spec,
                                    .completions = std::move(known.completions),
                                    .failures = {},
                                    .plan = std::move(known.plan)},
                                   farm_.store, files_, farm_.locked(job, spec), restart);
  const std::optional<std::string> mark = restart ? std::nullopt : farm_.lost_mark(job, spec);
  if (!mark) return lost;
  if (lost.num_frames == 0 || lost.all_frames_right()) {
    BATON_TRY(farm_.mark_output_again(job));
    lost.unreadable = farm_.lost_mark(job, spec);
  } else {
    lost.unreadable = mark;
  }
  return lost;
}

}  // namespace baton
