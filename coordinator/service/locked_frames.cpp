#include "coordinator/service/locked_frames.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <map>

#include "common/base/file_stamp.h"
#include "common/base/patiently.h"
#include "common/base/utc.h"
#include "common/job/file_sequence.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/store/frame_locks.h"
#include "coordinator/service/farm_document.h"

namespace baton {

LockedFrames::LockedFrames(const JobSpec& spec, const std::vector<FrameNumber>& numbers) {
  for (FrameIndex frame; frame.index() < spec.frames.size() && !numbers.empty(); ++frame) {
    if (std::ranges::binary_search(numbers, spec.frames[frame.index()])) frames_.insert(frame);
  }
}

std::vector<FrameNumber> LockedFrames::numbers(const JobSpec& spec) const {
  std::vector<FrameNumber> numbers;
  for (const FrameIndex frame : frames_) numbers.push_back(spec.frames[frame.index()]);
  return numbers;
}

std::string locked_text(const JobSpec& spec, const LockedFrames& locked) {
  if (locked.frames().empty()) return {};
  const std::vector<FrameNumber> numbers = locked.numbers(spec);
  const bool is_one = numbers.size() == 1;
  return fmt::format("{} {} {} locked and {} as {}", is_one ? "frame" : "frames",
                     format_frames(numbers), is_one ? "is" : "are", is_one ? "stays" : "stay",
                     is_one ? "it is" : "they are");
}

Result<std::vector<FrameIndex>> places_of(const JobSpec& spec,
                                          const std::vector<FrameNumber>& frames) {
  std::vector<FrameIndex> places;
  std::map<FrameNumber, FrameIndex> known;
  for (FrameIndex place; place.index() < spec.frames.size(); ++place)
    known[spec.frames[place.index()]] = place;
  std::vector<FrameNumber> unknown;
  for (const FrameNumber frame : frames) {
    const auto found = known.find(frame);
    if (found == known.end()) {
      unknown.push_back(frame);
    } else {
      places.push_back(found->second);
    }
  }
  if (!unknown.empty()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("job '{}': it has no frames {}, expected some of {}", spec.name,
                             format_frames(unknown), format_frames(spec.frames))};
  }
  return places;
}

Result<std::vector<FrameIndex>> frames_to_lock(const JobSpec& spec,
                                               const std::vector<FrameNumber>& frames,
                                               const Scheduler::Job* job) {
  BATON_ASSIGN(std::vector<FrameIndex> places, places_of(spec, frames));
  for (const FrameIndex frame : places) {
    const std::filesystem::path path = frame_path(spec, frame);
    BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(path));
    if (!stamp)
      return Error{ErrorKind::bad_input, path.string() + ": is not there, and cannot be locked"};
    const bool is_leased =
        job != nullptr && job->tasks.book().status(frame.value()) == TaskStatus::leased;
    if (is_leased) return Error{ErrorKind::timeout, path.string() + ": a worker is writing it"};
  }
  return places;
}

std::set<std::string> frame_files(const JobSpec& spec, const std::vector<FrameNumber>& frames) {
  std::set<std::string> files;
  for (const FrameNumber frame : frames)
    files.insert(frame_file_name(spec.output.pattern, frame.value()));
  return files;
}

namespace {

/// Those that can be read.
Result<std::vector<JobSpec>> specs_of(Journal& journal, const std::vector<Digest>& versions) {
  std::vector<JobSpec> specs;
  for (const Digest& version : versions) {
    BATON_ASSIGN(const SharedDocument known, journalled_document(journal, version));
    const Result<ParsedJobDocument>& document = known->parsed;
    if (document) specs.push_back(std::move(document->job));
  }
  return specs;
}

/// Under the names that they have in any of these versions.
Result<std::set<std::string>> files_of_versions(Journal& journal,
                                                const std::vector<Digest>& versions,
                                                const std::set<FrameNumber>& frames) {
  std::set<std::string> files;
  if (frames.empty()) return files;
  BATON_ASSIGN(const std::vector<JobSpec> specs, specs_of(journal, versions));
  for (const JobSpec& spec : specs) files.merge(frame_files(spec, {frames.begin(), frames.end()}));
  return files;
}

/// Frames of these versions that have files among those and are not locked; ascending.
Result<std::vector<FrameNumber>> frames_not_locked(Journal& journal,
                                                   const std::vector<Digest>& versions,
                                                   const std::set<std::string>& files,
                                                   const std::set<FrameNumber>& locked) {
  std::set<FrameNumber> frames;
  BATON_ASSIGN(const std::vector<JobSpec> specs, specs_of(journal, versions));
  for (const JobSpec& spec : specs) {
    for (const FrameNumber frame : spec.frames) {
      if (!locked.contains(frame) &&
          files.contains(frame_file_name(spec.output.pattern, frame.value())))
        frames.insert(frame);
    }
  }
  return std::vector<FrameNumber>(frames.begin(), frames.end());
}

}  // namespace

Status tell_locks(Journal& journal, const JobSpec& spec, const std::vector<Digest>& versions,
                  const JobId& id, const JobLocks& locks, const Roots& roots) {
  if (!check_output_root(spec, roots)) return {};
  BATON_ASSIGN(std::set<std::string> files, files_of_versions(journal, versions, locks.frames));
  files.merge(frame_files(spec, {locks.frames.begin(), locks.frames.end()}));
  BATON_TRY(record_locks(spec.output.directory, id.hex(), {files, locks.changed_ms}, roots));
  // The folder's name may lead elsewhere tomorrow.
  const std::string today = resolve_folder(spec.output.directory);
  if (!files.empty() && !versions.empty())
    BATON_TRY(journal.record_marked_folder(versions.back(), today));
  for (const Digest& version : versions) {
    BATON_ASSIGN(const std::vector<std::string> folders, journal.marked_folders(version));
    for (const std::string& folder : folders) {
      if (folder != today) BATON_TRY(retain_locks(folder, id.hex(), files, roots));
    }
  }
  return {};
}

Status tell_locks_again(Journal& journal, const JobSpec& spec, const IdentityBook& jobs,
                        const JobId& id, const Roots& roots) {
  const Status told = tell_locks(journal, spec, jobs.versions(id), id, jobs.locks(id), roots);
  // Whatever stands in a folder that is somebody's ends no coordinator.
  const bool is_of_folder =
      !told && (told.error().kind == ErrorKind::io || told.error().kind == ErrorKind::bad_input);
  if (!is_of_folder) return told;
  spdlog::warn("other coordinators do not see which frames are locked: {}", told.error().message);
  return {};
}

std::int64_t lock_time_ms(const IdentityBook& jobs, const JobId& id) {
  return std::max(now_ms(), jobs.locks(id).changed_ms + 1);
}

Result<std::map<JobId, std::vector<FrameNumber>>> settle_locks(Journal& journal, History& history,
                                                               const JobSpec& spec,
                                                               const Roots& roots) {
  std::map<JobId, std::vector<FrameNumber>> taken_up;
  if (!check_output_root(spec, roots)) return taken_up;
  const auto told = locks_by_job(spec.output.directory);
  if (!told) return taken_up;
  for (const auto& [job, in_folder] : *told) {
    const std::optional<JobId> id = JobId::from_hex(job);
    const auto versions = id ? history.jobs().versions(*id) : std::vector<Digest>();
    if (versions.empty()) continue;
    const JobLocks known = history.jobs().locks(*id);
    if (in_folder.changed_ms > known.changed_ms) {
      BATON_ASSIGN(std::vector<FrameNumber> frames,
                   frames_not_locked(journal, versions, in_folder.files, known.frames));
      if (frames.empty()) continue;
      const std::string why = fmt::format(", by {}, which is newer than the journal",
                                          (lock_folder(spec.output.directory) / job).string());
      spdlog::warn("job {}: frames {} are locked{}", id->short_hex(), format_frames(frames), why);
      BATON_TRY(history.locked(versions.back(), frames, true, in_folder.changed_ms, why));
      taken_up[*id] = std::move(frames);
    } else {
      BATON_ASSIGN(const std::set<std::string> files,
                   files_of_versions(journal, versions, known.frames));
      if (const Status dropped = retain_locks(spec.output.directory, job, files, roots); !dropped)
        spdlog::warn("locks stay for other coordinators: {}", dropped.error().message);
    }
  }
  return taken_up;
}

Error locked_elsewhere(const JobSpec& job, const std::vector<FrameNumber>& frames,
                       const std::string& other_name, const std::vector<FrameNumber>& there) {
  return {ErrorKind::bad_input,
          fmt::format("job '{}': frames {} in {} are locked in job {}, and stay: `baton job lock "
                      "{} --off --frames {}` unlocks them, another output.directory keeps them",
                      job.name, format_frames(frames), job.output.directory, other_name, other_name,
                      format_frames(there))};
}

Status expect_no_strange_locks(const JobSpec& spec, const IdentityBook& jobs, const JobId& id) {
  const auto locks = patiently([&] { return locks_of_others(spec.output.directory, {}); });
  if (!locks) return Error{ErrorKind::io, locks.error().message};
  const std::set<FrameNumber> own = jobs.locks(id).frames;
  std::vector<FrameNumber> strange, renumbered;
  std::map<JobId, std::vector<FrameNumber>> known;
  for (const FrameNumber frame : spec.frames) {
    const auto lock = locks->find(frame_file_name(spec.output.pattern, frame.value()));
    if (lock == locks->end()) continue;
    const std::optional<JobId> other = JobId::from_hex(lock->second);
    if (other == id) {
      if (!own.contains(frame)) renumbered.push_back(frame);
    } else if (!other || jobs.versions(*other).empty()) {
      strange.push_back(frame);
    } else {  // under another name that the folder had
      known[*other].push_back(frame);
    }
  }
  if (!known.empty())
    return locked_elsewhere(spec, known.begin()->second, known.begin()->first.short_hex(),
                            jobs.locked(known.begin()->first));
  if (!renumbered.empty()) {
    return Error{
        ErrorKind::bad_input,
        fmt::format(
            "job '{}': frames {} would write files in {} that are locked under other "
            "numbers, and stay: `baton job lock {} --off --frames {}` unlocks them, another "
            "output.pattern or output.directory keeps them",
            spec.name, format_frames(renumbered), spec.output.directory, id.short_hex(),
            format_frames(jobs.locked(id)))};
  }
  if (strange.empty()) return {};
  return Error{
      ErrorKind::bad_input,
      fmt::format("job '{}': frames {} in {} are locked by a job of another coordinator, and stay: "
                  "unlock them there or, if it is gone, remove its file in {}; another "
                  "output.directory keeps them",
                  spec.name, format_frames(strange), spec.output.directory,
                  lock_folder(spec.output.directory).string())};
}

Status expect_locked(const JobId& job, const std::vector<FrameNumber>& locked,
                     const std::vector<FrameNumber>& frames) {
  std::vector<FrameNumber> others;
  std::ranges::set_difference(frames, locked, std::back_inserter(others));
  if (others.empty()) return {};
  return Error{ErrorKind::bad_input, fmt::format("job {}: frames {} are not locked",
                                                 job.short_hex(), format_frames(others))};
}

}  // namespace baton
