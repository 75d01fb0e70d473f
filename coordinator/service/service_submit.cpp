#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "common/base/archive.h"
#include "common/base/limits.h"
#include "common/job/plan/sequence.h"
#include "coordinator/service/plan_text.h"
#include "coordinator/service/service.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// The frames of two jobs that write the same file.
std::vector<std::pair<FrameIndex, FrameIndex>> shared_frames(const JobSpec& a, const JobSpec& b) {
  std::map<std::string, FrameIndex> of_b;
  FrameIndex place{0};
  for (const FrameNumber frame : b.frames) {
    of_b[frame_file_name(b.output.pattern, frame.value())] = place;
    ++place;
  }
  std::vector<std::pair<FrameIndex, FrameIndex>> shared;
  place = FrameIndex(0);
  for (const FrameNumber frame : a.frames) {
    const auto found = of_b.find(frame_file_name(a.output.pattern, frame.value()));
    if (found != of_b.end()) shared.emplace_back(place, found->second);
    ++place;
  }
  return shared;
}

/// Another job that writes, or has written, into the folder of a new one.
struct Neighbour {
  Digest job;
  JobStatus status = JobStatus::running;
  /// Frames in common that it has written; all of them if it is open.
  std::vector<FrameNumber> written;
  /// What makes their pixels others; empty: they are the same.
  std::vector<std::string> differing;
  std::optional<FrameNumber> first_differing;
  bool busy = false;          ///< it is open and shares no frame
  std::size_t num_there = 0;  ///< frames in common that it has written
};

std::string differing_text(const std::vector<std::string>& differing) {
  constexpr std::size_t kMost = 8;
  const auto shown = std::span(differing).first(std::min(kMost, differing.size()));
  return fmt::format("{}{}", fmt::join(shown, ", "), differing.size() > kMost ? ", ..." : "");
}

Error another_picture(const JobSpec& job, const Neighbour& other, const JobSpec& other_job) {
  std::string text = fmt::format(
      "job '{}': its frames would replace those of job {} ('{}', {}, {} of {} frames) in {}, which "
      "is another picture; what differs: {}\n"
      "--restart replaces them, another output.directory keeps them",
      job.name, other.job.short_hex(), other_job.name, job_status_name(other.status),
      other.num_there, other_job.frames.size(), job.output.directory,
      differing_text(other.differing));
  text += "; --from-frame N keeps those before frame N and renders from there on afresh";
  if (other.first_differing && *other.first_differing != other.written.front())
    text +=
        fmt::format("\nframes before {} are the same and stay in any case", *other.first_differing);
  return {ErrorKind::bad_input, std::move(text)};
}

/// What a journalled job has written, beside a new one. owned: its frames by number, without those
/// that another one has replaced; null: all.
Neighbour look_at(const FormerJob& former, const Digest& job, const ParsedJobDocument& wanted,
                  FileTable& files, const std::vector<FrameNumber>* owned) {
  const JobStatus status = former.status;
  Neighbour other{job, status, {}, {}, {}, false, 0};
  const JobSpec& theirs = former.document.job;
  const auto shared = shared_frames(theirs, wanted.job);
  std::map<FrameIndex, BlobRef> images;
  for (const Completions::Task& task : former.tasks) {
    if (task.task.kind == TaskKind::assemble && task.outputs.size() == 1)
      images[task.task.frame()] = task.outputs.front();
  }

  // A frame belongs to the job that wrote it as long as its file is unchanged.
  const std::vector<std::string> picture = picture_differences(former.document, wanted);
  const FrameComparison comparison(former.document, wanted);
  std::set<std::string> differing;
  for (const auto& [mine, its] : shared) {
    const auto image = images.find(mine);
    const bool is_owned =
        owned == nullptr ||
        std::find(owned->begin(), owned->end(), theirs.frames[mine.index()]) != owned->end();
    const bool is_there = is_owned && image != images.end() &&
                          files.holds(frame_path(theirs, mine), image->second).value_or(false);
    other.num_there += is_there ? 1 : 0;
    if (!is_there && !is_open(status)) continue;
    other.written.push_back(wanted.job.frames[its.index()]);
    differing.insert(picture.begin(), picture.end());
    // More sweeps make a frame cleaner; what is not written may have had more.
    const bool may_replace = !is_there || wanted.job.quality.sweeps > theirs.quality.sweeps;
    const bool is_same =
        may_replace ? comparison.are_alike(mine, its) : comparison.are_equal(mine, its);
    if (picture.empty() && is_same) continue;
    if (picture.empty() && differing.size() < 3) differing.insert(comparison.difference(mine, its));
    if (!other.first_differing) other.first_differing = wanted.job.frames[its.index()];
  }
  other.differing.assign(differing.begin(), differing.end());
  other.busy = is_open(status) && shared.empty();
  return other;
}

}  // namespace

// ---- another job of the folder ------------------------------------------------------------------

/// What the journal knows of a job, as far as a later one can use it. nullopt: it cannot be read.
Result<std::optional<FormerJob>> Service::former_job(const Digest& digest) {
  BATON_ASSIGN(const std::optional<std::string> text, journal_.document(digest));
  Result<ParsedJobDocument> document = parse_job_document(text.value_or(""));
  if (!document) return std::optional<FormerJob>();
  BATON_ASSIGN(JournalledJob known, journal_.load(digest));
  FormerJob former{std::move(document).value(), std::move(known.completions.tasks),
                   std::move(known.plan), known.status};
  former.document.job.leading_runs = former.plan.leading_runs;
  return std::optional(std::move(former));
}

/// Makes room for a new job: a folder has one open job, and a frame in it belongs to the job that
/// wrote it. Jobs of the same picture end and leave their work. Jobs of another picture whose
/// frames would be replaced refuse the new one (bad_input, usage); with `restart` they end. Returns
/// lines that say what is replaced, and why.
Result<std::vector<std::string>> Service::make_way(const ParsedJobDocument& document,
                                                   bool restart) {
  std::vector<std::string> reasons;
  std::vector<Neighbour> others;
  BATON_ASSIGN(const std::vector<Digest> neighbours, journal_.jobs_in(folder_of(document.job)));
  for (const Digest& digest : neighbours) {
    if (digest == document.digest) continue;
    BATON_ASSIGN(const std::optional<FormerJob> former, former_job(digest));
    if (!former) continue;
    BATON_ASSIGN(const std::optional<JobDetail> ended, archived_detail(digest));
    Neighbour other =
        look_at(*former, digest, document, files_, ended ? &ended->frames_done : nullptr);
    if (other.busy && !restart) {
      return Error{
          ErrorKind::bad_input,
          fmt::format("job '{}': job {} ('{}', {}) writes into {}: wait for its end, cancel "
                      "it, or choose another output.directory",
                      document.job.name, digest.short_hex(), former->document.job.name,
                      job_status_name(other.status), document.job.output.directory)};
    }
    if (!other.differing.empty() && !restart)
      return another_picture(document.job, other, former->document.job);
    if (other.written.empty() && !other.busy) continue;
    if (is_open(other.status) || !other.differing.empty()) BATON_TRY(check_own(digest));
    others.push_back(std::move(other));
  }

  for (const Neighbour& other : others) {
    if (is_open(other.status)) {
      spdlog::info("job {} makes way for job {}", other.job.short_hex(),
                   document.digest.short_hex());
      BATON_TRY(step(JobSuperseded{other.job, {}}));
      BATON_TRY(archive_job(other.job));
    }
    if (other.differing.empty()) continue;
    BATON_TRY(disown(other.job, other.written));
    reasons.push_back(fmt::format("{} of job {} {} replaced: {} differs",
                                  other.written.size() == 1 ? "a frame" : "frames",
                                  other.job.short_hex(), other.written.size() == 1 ? "is" : "are",
                                  differing_text(other.differing)));
  }
  return reasons;
}

/// Takes frames that another picture replaces off the record of a job in the archive.
Status Service::disown(const Digest& job, const std::vector<FrameNumber>& frames) {
  BATON_ASSIGN(std::optional<JobDetail> detail, archived_detail(job));
  if (!detail) return {};
  std::erase_if(detail->frames_done, [&](FrameNumber frame) {
    return std::find(frames.begin(), frames.end(), frame) != frames.end();
  });
  JobSummary& summary = detail->summary;
  summary.frames_done = static_cast<std::uint32_t>(detail->frames_done.size());
  if (summary.status == JobStatus::done) summary.status = JobStatus::cancelled;
  return journal_.describe_archived(job, summary.status, to_bytes(summary), to_bytes(*detail));
}

// ---- submission ---------------------------------------------------------------------------------

Status Service::receive(const PeerId& peer, const SubmitJob& message) {
  // Jobs that ended in this turn of the loop are read from the archive, too.
  BATON_TRY(archive_ended());
  // A job that cannot be run is refused before it leaves a trace.
  Result<ParsedJobDocument> document = parse_job_document(message.json);
  if (!document) return refuse(peer, document.error());
  if (const Status within = check_roots(*document, options_.roots); !within) {
    spdlog::warn("refused: job '{}': {}", document->job.name, within.error().message);
    return refuse(peer, within.error());
  }
  if (const std::int64_t count = count_tasks(document->job); count > limits::kMaxTasksPerJob) {
    return refuse(
        peer,
        {ErrorKind::bad_input,
         fmt::format("job {}: {} tasks, at most {}: use larger tiles or more frames per checkpoint",
                     document->digest.short_hex(), count, limits::kMaxTasksPerJob)});
  }
  BATON_ASSIGN(const bool waits, await_frames(peer, message, document->digest, document->job));
  if (waits) return {};
  const Scheduler::Job* const known = scheduler_.find_job(document->digest);
  if (known != nullptr) {
    if (const Status own = check_own(document->digest);
        known->status != JobStatus::running && !own) {
      return refuse(peer, own.error());
    }
    return go_on(peer, document->digest);
  }

  if (scheduler_.num_jobs() >= limits::kMaxJobs) {
    return refuse(peer, {ErrorKind::io, fmt::format("the farm is full: {} jobs that have not ended",
                                                    limits::kMaxJobs)});
  }
  Result<std::vector<std::string>> reasons = make_way(*document, message.restart);
  if (!reasons) {
    const ErrorKind kind = reasons.error().kind;
    if (kind != ErrorKind::bad_input && kind != ErrorKind::usage) return reasons.error();
    return refuse(peer, reasons.error());
  }
  return begin(peer, *document, message.json, std::move(*reasons));
}

/// Starts a job with all that former ones of its picture leave to it.
Status Service::begin(const PeerId& peer, const ParsedJobDocument& document,
                      const std::string& text, std::vector<std::string> reasons) {
  const Digest digest = document.digest;
  std::vector<Digest> formers;
  BATON_ASSIGN(Adoption adoption, find_heritage(document, formers, reasons));

  JobAdded event{digest, document.job, JobStatus::running, {}, {}};
  BATON_ASSIGN(const std::optional<std::string> known, journal_.document(digest));
  BATON_TRY(take_over(adoption, formers, known ? "" : text, event));
  LostFiles lost = find_lost_files(event, store_);
  for (std::string& reason : lost_reasons(lost)) {
    if (std::find(reasons.begin(), reasons.end(), reason) == reasons.end())
      reasons.push_back(std::move(reason));
  }
  event.lost.insert(event.lost.end(), lost.tasks.begin(), lost.tasks.end());
  event.lost_spares = std::move(lost.spares);

  // The answer goes out before any lease of the job.
  const auto place = static_cast<std::ptrdiff_t>(outbox_.size());
  BATON_TRY(step(event));
  const Scheduler::Job& job = *scheduler_.find_job(digest);
  const std::string plan = plan_text(job, reasons);
  const bool already_there = known && !is_open(job.status) && event.lost.empty();
  outbox_.insert(outbox_.begin() + place, {peer, JobAccepted{digest, already_there, plan}});
  spdlog::info("job {} {}: '{}', {} of {} tasks are done", digest.short_hex(),
               known ? "goes on" : "submitted", job.spec.name, job.tasks.progress().tasks_done,
               job.tasks.progress().tasks_total);
  if (!plan.empty()) spdlog::info("job {}: {}", digest.short_hex(), plan);

  // Blobs that the new job needs are not kept for the former ones any more.
  for (const Digest& former : formers) {
    BATON_ASSIGN(const std::vector<Digest> kept, journal_.kept_blobs(former));
    for (const Digest& blob : kept) {
      if (scheduler_.is_referenced(blob)) BATON_TRY(journal_.let_go(former, blob));
    }
  }
  return {};
}

/// What jobs of the same picture in the same folder leave to a new one, itself among them.
Result<Adoption> Service::find_heritage(const ParsedJobDocument& document,
                                        std::vector<Digest>& digests,
                                        std::vector<std::string>& reasons) {
  BATON_ASSIGN(const std::vector<Digest> neighbours, journal_.jobs_in(folder_of(document.job)));
  std::vector<FormerJob> formers;
  for (const Digest& digest : neighbours) {
    BATON_ASSIGN(std::optional<FormerJob> former, former_job(digest));
    if (!former || !(former->document.picture == document.picture)) continue;
    formers.push_back(std::move(*former));
    digests.push_back(digest);
  }
  const KeptFiles kept{
      .has_frame =
          [&](FrameIndex frame, const BlobRef& image) {
            return files_.holds(frame_path(document.job, frame), image).value_or(false);
          },
      .has_blob = [&](const BlobRef& blob) { return store_.contains(blob.digest); }};
  Adoption adoption = adopt(document, formers, kept);
  if (!formers.empty()) {
    for (std::string& reason :
         output_reasons(formers.back().document.job, document.job, adoption.other_plates))
      reasons.push_back(std::move(reason));
  }
  constexpr std::size_t kMost = 8;
  for (std::size_t i = 0; i < adoption.lost.size() && i < kMost; ++i) {
    reasons.push_back(fmt::format("{} is gone, or not as it was written",
                                  frame_path(document.job, adoption.lost[i]).string()));
  }
  if (adoption.lost.size() > kMost)
    reasons.push_back(fmt::format("and {} frames more", adoption.lost.size() - kMost));
  return adoption;
}

/// Journals a job as if it had itself done what it adopts, and adds that to the event. text: the
/// document; empty: the journal has it.
Status Service::take_over(const Adoption& adoption, const std::vector<Digest>& formers,
                          const std::string& text, JobAdded& event) {
  // Read before the journal changes, since the job may go on from itself. A kept frame has the
  // statistics of its assembly if that is the former job's.
  std::map<FrameIndex, BlobRef> images;
  for (const BlobRef& image : adoption.images) images[image.frame()] = image;
  const std::set<TaskKey> tasks(adoption.tasks.begin(), adoption.tasks.end());
  const std::set<FrameIndex> lost(adoption.lost.begin(), adoption.lost.end());
  std::vector<Completion> taken;
  if (adoption.former) {
    const Digest& former = formers[*adoption.former];
    BATON_TRY(journal_.for_each_completion(former, [&](const Completion& completion) -> Status {
      const bool is_assembly = completion.task.kind == TaskKind::assemble;
      const auto image = is_assembly ? images.find(completion.task.frame()) : images.end();
      const bool is_frame = image != images.end() && completion.outputs.size() == 1 &&
                            completion.outputs.front() == image->second;
      if (is_frame) images.erase(image);
      // A frame that the job itself wrote and that is gone must come out as it was.
      const bool is_lost =
          former == event.job && is_assembly && lost.contains(completion.task.frame());
      if (is_lost) event.lost.push_back(completion.task);
      if (is_frame || is_lost || tasks.contains(completion.task)) taken.push_back(completion);
      return {};
    }));
  }
  for (const auto& [frame, image] : images)
    taken.push_back({assemble_task(frame), {image}, {}, {}});
  for (const TaskKey& task : adoption.settled) taken.push_back({task, {}, {}, {}});

  if (text.empty()) {
    BATON_TRY(journal_.restart_job(event.job));
  } else {
    BATON_TRY(journal_.add_job(event.job, text, {event.spec.name, folder_of(event.spec)}));
  }
  BATON_TRY(journal_.record_plan(event.job, adoption.plan));
  if (!speaker_.name.empty() && !owners_.contains(event.job)) {
    owners_[event.job] = speaker_.name;
    BATON_TRY(journal_.record_owner(event.job, speaker_.name));
  }
  event.spec.leading_runs = adoption.plan.leading_runs;
  event.plan = adoption.plan;
  for (const Completion& completion : taken) {
    BATON_TRY(journal_.record_completion(event.job, completion));
    event.completions.add(completion);
  }
  return {};
}

/// A job that has not ended is submitted again. A paused one goes on, and what is gone or damaged
/// is made again; a folder that is not there counts as empty.
Status Service::go_on(const PeerId& peer, const Digest& digest) {
  BATON_ASSIGN(LostFiles lost, lost_files_of(digest));
  const bool runs = scheduler_.find_job(digest)->status == JobStatus::running;
  std::vector<std::string> reasons = lost_reasons(lost);
  const auto noted = lost_before_.find(digest);
  if (reasons.empty() && noted != lost_before_.end()) reasons = noted->second;
  const auto place = static_cast<std::ptrdiff_t>(outbox_.size());
  if (runs && !lost.tasks.empty()) BATON_TRY(step(JobPaused{digest}));
  if (!runs || !lost.tasks.empty()) BATON_TRY(step(JobResumed{digest, std::move(lost.tasks)}));
  const std::string plan = plan_text(*scheduler_.find_job(digest), reasons);
  outbox_.insert(outbox_.begin() + place, {peer, JobAccepted{digest, true, plan}});
  return {};
}

}  // namespace baton
