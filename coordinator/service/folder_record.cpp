#include "coordinator/service/folder_record.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/patiently.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "common/job/text/picture.h"
#include "common/store/frame_locks.h"
#include "coordinator/service/farm_document.h"
#include "coordinator/service/job_report.h"
#include "coordinator/service/neighbour.h"

namespace baton {

namespace fs = std::filesystem;

namespace {

/// Those frames of a job that another one would make again as they are, or with more sweeps.
std::set<FrameIndex> made_again(const ParsedJobDocument& theirs, std::set<FrameIndex> frames,
                                const ParsedJobDocument& mine) {
  if (frames.empty() || theirs.picture != mine.picture) return {};
  const FramesByFile by_file(mine);
  const FrameComparison comparison(theirs, mine);
  const bool has_more_sweeps = mine.job.quality.sweeps > theirs.job.quality.sweeps;
  std::erase_if(frames, [&](FrameIndex frame) {
    const std::optional<FrameIndex> place = by_file.find(theirs.job, frame);
    if (!place) return true;
    return has_more_sweeps ? !comparison.are_alike(frame, *place)
                           : !comparison.are_equal(frame, *place);
  });
  return frames;
}

}  // namespace

Result<FolderRecord> FolderRecord::read(Journal& journal, const IdentityBook& jobs,
                                        const Digest& version) {
  BATON_ASSIGN(const SharedDocument document, journalled_document(journal, version));
  if (!document->parsed) return document->parsed.error();
  return read(journal, jobs, *document->parsed, jobs.of(version).id);
}

Result<FolderRecord> FolderRecord::read(Journal& journal, const IdentityBook& jobs,
                                        const ParsedJobDocument& document, const JobId& id) {
  const std::string& folder = document.job.output.directory;
  const Digest& version = document.digest;
  FolderRecord record;
  record.version_ = version;
  record.family_ = jobs.versions(id);
  BATON_ASSIGN(record.jobs_[version].renderers, journal.renderers(version));
  if (auto locks = patiently([&] { return locks_of_others(folder, {}); }))
    record.locked_ = std::move(*locks);
  BATON_ASSIGN(const auto given_up, journal.given_up(id));
  for (const auto& [file, picture] : given_up) record.given_up_[fs::path(folder) / file] = picture;
  BATON_ASSIGN(const std::vector<Digest> neighbours, jobs_in_folder(journal, folder));
  for (const Digest& other : neighbours) {
    BATON_ASSIGN(const SharedDocument written, journalled_document(journal, other));
    if (!written->parsed) continue;
    const JobSpec& spec = written->parsed->job;
    const auto path_of = [&](FrameIndex frame) {
      return fs::path(folder) /
             frame_file_name(spec.output.pattern, spec.frames[frame.index()].value());
    };
    Writer& writer = record.jobs_[other];
    BATON_ASSIGN(writer.renderers, journal.renderers(other));
    BATON_ASSIGN(const auto granted, journal.frame_files(other));
    std::map<fs::path, std::int64_t> rendered;
    std::set<FrameIndex> may_be_there;  // and was not reported
    for (const auto& [frame, file] : granted) {
      if (frame.index() >= spec.frames.size()) continue;
      if (!file.is_gone) may_be_there.insert(frame);
      if (file.rendered != 0) rendered[path_of(frame)] = file.rendered;
    }
    // What another job had when it ended, less what it has lost since.
    std::optional<std::set<FrameNumber>> has;
    if (jobs.of(other).id != id) {
      BATON_ASSIGN(const auto ended, archived_detail(journal, other, other.short_hex()));
      if (ended) has.emplace(ended->frames_done.begin(), ended->frames_done.end());
    }
    BATON_TRY(journal.for_each_completion(other, [&](const Completion& done) -> Status {
      if (done.task.kind != TaskKind::assemble || done.made.outputs.size() != 1) return {};
      const FrameIndex frame = done.task.frame();
      if (frame.index() >= spec.frames.size()) return {};
      if (!done.made.outputs.front().is_placeholder()) may_be_there.erase(frame);
      const bool is_given_away = has && !has->contains(spec.frames[frame.index()]);
      const fs::path path = path_of(frame);
      const auto last = rendered.extract(path);
      record.images_[path].push_back({.job = other,
                                      .image = done.made.outputs.front(),
                                      .is_given_away = is_given_away,
                                      .rendered = last ? last.mapped() : 0});
      return {};
    }));
    const bool is_of_job = std::ranges::find(record.family_, other) != record.family_.end();
    if (!is_of_job) may_be_there = made_again(*written->parsed, may_be_there, document);
    for (const FrameIndex frame : may_be_there) writer.granted.insert(path_of(frame));
    for (const auto& [path, last] : rendered)
      record.images_[path].push_back(
          {.job = other, .image = {}, .rendered = last, .is_lost = true});
  }
  record.mark_superseded();
  return record;
}

void FolderRecord::mark_superseded() {
  const auto age = [&](const Image& image) {
    return std::ranges::find(family_, image.job) - family_.begin();
  };
  const auto is_of_job = [&](const Image& image) { return age(image) < std::ssize(family_); };
  const auto is_there = [](const Image& image) { return !image.image.is_placeholder(); };
  for (auto& [path, images] : images_) {
    // One that was kept is as new as when it was rendered, by whichever job.
    std::map<Digest, std::int64_t> rendered;
    for (const Image& image : images) {
      std::int64_t& last = rendered[image.image.digest];
      if (is_there(image)) last = std::max(last, image.rendered);
    }
    std::ptrdiff_t newest = -1;
    for (Image& image : images) {
      if (is_there(image)) image.rendered = rendered[image.image.digest];
      if (is_of_job(image) && is_there(image)) newest = std::max(newest, age(image));
    }
    for (Image& image : images) {
      const bool is_own = is_of_job(image);
      // One that was given away stays what it is until there is another in its place, be that to be
      // rendered once more by now.
      const bool came_before = std::ranges::any_of(images, [&](const Image& other) {
        const bool is_later =
            other.rendered > image.rendered || (image.rendered == 0 && is_there(other));
        return is_later && (is_own ? other.is_lost && is_of_job(other)
                                   : image.is_given_away && !other.is_given_away);
      });
      image.is_superseded = image.job != version_ && is_there(image) &&
                            (came_before || (is_own && age(image) < newest));
    }
  }
}

std::vector<BlobRef> FolderRecord::images_of(const fs::path& path) const {
  std::vector<BlobRef> recorded;
  const auto found = images_.find(path);
  if (found == images_.end()) return recorded;
  for (const Image& image : found->second) {
    if (!image.is_superseded && !image.is_lost) recorded.push_back(image.image);
  }
  return recorded;
}

bool FolderRecord::is_recorded(const fs::path& path, const FileVerdict& picture) const {
  if (is_locked(path)) return false;
  const auto given_up = given_up_.find(path);
  if (given_up != given_up_.end() && given_up->second == picture.digest) return true;
  const std::vector<BlobRef> images = images_of(path);
  return std::ranges::find(images, picture.digest, &BlobRef::digest) != images.end();
}

bool FolderRecord::may_be_unreported(const fs::path& path, const FileVerdict& picture) const {
  const auto writer = std::ranges::find_if(
      jobs_, [&](const auto& job) { return picture.writer.starts_with(job.first.hex()); });
  if (writer == jobs_.end() || is_locked(path)) return false;
  const Digest& job = writer->first;
  const std::set<std::string>& renderers = writer->second.renderers;
  // One that is not said was reported here (Service::keep_frame_file).
  const bool is_by_us = renderers.empty() || picture.writer == job.hex() ||
                        std::ranges::any_of(renderers, [&](const auto& known) {
                          return picture.writer.ends_with(known);
                        });
  const auto images = images_.find(path);
  const bool is_reported =
      images != images_.end() && std::ranges::any_of(images->second, [&](const Image& image) {
        return image.job == job && !image.is_lost && !image.image.is_placeholder();
      });
  return is_by_us && !is_reported && (job == version_ || writer->second.granted.contains(path));
}

std::optional<Digest> FolderRecord::writer_of(const FileVerdict& picture) const {
  for (const auto& [job, known] : jobs_) {
    if (picture.writer.starts_with(job.hex())) return job;
  }
  return std::nullopt;
}

bool FolderRecord::is_foreign(const FileVerdict& picture) const {
  return !picture.writer.empty() && std::ranges::none_of(jobs_, [&](const auto& job) {
    return picture.writer.starts_with(job.first.hex());
  });
}

std::vector<Digest> FolderRecord::replaceable(const fs::path& path) const {
  std::vector<Digest> digests;
  if (is_locked(path)) return digests;
  if (const auto given_up = given_up_.find(path); given_up != given_up_.end())
    digests.push_back(given_up->second);
  const std::vector<BlobRef> images = images_of(path);
  for (auto image = images.rbegin(); image != images.rend() && digests.size() < kMostTold;
       ++image) {
    if (!image->is_placeholder()) digests.push_back(image->digest);
  }
  return digests;
}

void FolderRecord::give_up(const fs::path& path, const Digest& picture) {
  given_up_[path] = picture;
}

OddFrames find_odd_frames(const FolderRecord& record, const FileTable& files, const JobSpec& spec,
                          const LockedFrames& locked, bool restart) {
  OddFrames odd;
  BlobRef nothing;
  nothing.kind = BlobKind::image;
  for (FrameIndex frame; frame.index() < spec.frames.size(); ++frame) {
    const fs::path path = frame_path(spec, frame);
    const FrameNumber number = spec.frames[frame.index()];
    if (locked.contains(frame)) {
      const FileVerdict verdict = judge_locked(path);
      if (verdict.state == FileState::absent)
        odd.doubt.locked_absent.push_back({path.string(), number});
      if (verdict.state == FileState::unreadable) {
        odd.unreadable = verdict.fault;
        odd.is_locked_unreadable = true;
      }
      continue;
    }
    const std::vector<BlobRef> images = record.images_of(path);
    FileVerdict verdict = files.judge(path, images.empty() ? nothing : images.front());
    for (const BlobRef& image : images) {
      if (verdict.state != FileState::right && files.is_right(path, image))
        verdict.state = FileState::right;
    }
    if (verdict.state == FileState::unknown) {
      FileToRead file{path};
      file.is_frame = true;
      for (const BlobRef& image : images) {
        file.expected.push_back(image.digest);
        file.sizes.push_back(image.size_bytes);
      }
      odd.unread.push_back(std::move(file));
    } else if (verdict.state == FileState::unreadable) {
      odd.unreadable = verdict.fault;
    } else if (verdict.state == FileState::strange &&
               !(restart ? record.is_recorded(path, verdict) : record.may_replace(path, verdict))) {
      odd.doubt.strange.push_back({path.string(), number, verdict.digest,
                                   record.is_foreign(verdict), record.writer_of(verdict)});
    }
  }
  return odd;
}

namespace {

/// "A, B and 3 more".
std::string files_text(const std::vector<FramesInDoubt::Frame>& frames) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, frames.size()); ++i)
    text += (i > 0 ? ", " : "") + frames[i].file;
  return text + (frames.size() > kMost ? fmt::format(" and {} more", frames.size() - kMost) : "");
}

std::vector<FrameNumber> numbers_of(const std::vector<FramesInDoubt::Frame>& frames) {
  std::vector<FrameNumber> numbers;
  for (const FramesInDoubt::Frame& frame : frames) numbers.push_back(frame.number);
  return numbers;
}

/// Under which numbers the files of frames are a job's, as far as they are.
std::vector<FrameNumber> numbers_in(const JobSpec& job,
                                    const std::vector<FramesInDoubt::Frame>& frames) {
  std::vector<FrameNumber> numbers;
  for (const FrameNumber number : job.frames) {
    const fs::path path =
        fs::path(job.output.directory) / frame_file_name(job.output.pattern, number.value());
    if (std::ranges::find(frames, path.string(), &FramesInDoubt::Frame::file) != frames.end())
      numbers.push_back(number);
  }
  return numbers;
}

}  // namespace

std::string doubt_text(const FramesInDoubt& doubt, const JobId& job, const JobSpec* known) {
  std::string text;
  if (const auto& frames = doubt.strange; !frames.empty()) {
    const bool is_one = frames.size() == 1;
    const bool are_foreign = std::ranges::all_of(frames, &FramesInDoubt::Frame::is_foreign);
    text = fmt::format(
        "{} {} not what a job has written here: {}, which is kept; --restart renders {} again",
        files_text(frames), is_one ? "is" : "are",
        are_foreign ? "by a job that is none of this folder's (deleted, moved, or another "
                      "coordinator's)"
                    : "another picture, changed or replaced",
        is_one ? "it" : "them");
    const std::vector<FrameNumber> numbers =
        known ? numbers_in(*known, frames) : numbers_of(frames);
    if (!job.empty() && !numbers.empty())
      text += fmt::format(", `baton job lock {} --frames {}` keeps {} for good", job.short_hex(),
                          format_frames(numbers),
                          numbers.size() < frames.size() ? "those"
                          : is_one                       ? "it"
                                                         : "them");
  }
  if (const auto& frames = doubt.locked_absent; !frames.empty()) {
    const bool is_one = frames.size() == 1;
    text += fmt::format(
        "{}{} {} locked and not there: put {} back, or have {} rendered with `baton job lock {} "
        "--off --frames {}`",
        text.empty() ? "" : "; ", files_text(frames), is_one ? "is" : "are", is_one ? "it" : "them",
        is_one ? "it" : "them", job.short_hex(), format_frames(numbers_of(frames)));
  }
  return text;
}

std::string fault_text(const OddFrames& odd, const JobId& job, const JobSpec* known) {
  return odd.unreadable.empty() ? doubt_text(odd.doubt, job, known) : odd.unreadable;
}

}  // namespace baton
