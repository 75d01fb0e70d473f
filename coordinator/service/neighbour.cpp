#include "coordinator/service/neighbour.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"

namespace baton {
namespace {}  // namespace

std::string differing_text(const std::vector<std::string>& differing) {
  constexpr std::size_t kMost = 8;
  const auto shown = std::span(differing).first(std::min(kMost, differing.size()));
  return fmt::format("{}{}", fmt::join(shown, ", "), differing.size() > kMost ? ", ..." : "");
}

Error another_picture(const JobSpec& job, const Neighbour& other, const JobSpec& other_job,
                      const std::string& other_name) {
  std::string text = fmt::format(
      "job '{}': it would replace {} of the {} frames of job {} ('{}', {}) in {}, which is another "
      "picture; what differs: {}\n"
      "--restart replaces them, another output.directory keeps them",
      job.name, other.written.size(), other_job.frames.size(), other_name, other_job.name,
      job_status_name(other.status), job.output.directory, differing_text(other.differing));
  text += "; --from-frame N keeps those before frame N and renders from there on afresh";
  if (other.first_differing && *other.first_differing != other.written.front())
    text +=
        fmt::format("\nframes before {} are the same and stay in any case", *other.first_differing);
  return {ErrorKind::bad_input, std::move(text)};
}

FramesByFile::FramesByFile(const ParsedJobDocument& document) : document_(document) {
  FrameIndex place{0};
  for (const FrameNumber frame : document.job.frames) {
    places_[frame_file_name(document.job.output.pattern, frame.value())] = place;
    ++place;
  }
}

std::optional<FrameIndex> FramesByFile::find(const JobSpec& other, FrameIndex frame) const {
  const auto found =
      places_.find(frame_file_name(other.output.pattern, other.frames[frame.index()].value()));
  return found == places_.end() ? std::nullopt : std::optional(found->second);
}

namespace {

/// The frames of a job of which something may be there: all of one that is open, else those that it
/// has written and that are locked.
std::set<FrameIndex> frames_with_something(const FormerJob& former,
                                           const std::map<FrameIndex, BlobRef>& images,
                                           const LockedFrames& locked) {
  std::set<FrameIndex> frames = locked.frames();
  for (const auto& [frame, image] : images) frames.insert(frame);
  const FrameIndex end(static_cast<std::int32_t>(former.document.job.frames.size()));
  for (FrameIndex frame; is_open(former.status) && frame < end; ++frame)
    frames.insert(frames.end(), frame);
  return frames;
}

}  // namespace

Neighbour look_at(const FormerJob& former, const Digest& job, const FramesByFile& frames,
                  const FileTable& files, const std::vector<FrameNumber>* owned,
                  const Locks& locks) {
  const JobStatus status = former.status;
  Neighbour other{.job = job, .status = status};
  const ParsedJobDocument& wanted = frames.document();
  const JobSpec& theirs = former.document.job;
  std::map<FrameIndex, BlobRef> images;
  for (const Completions::Task& task : former.tasks) {
    if (task.task.kind == TaskKind::assemble && task.outputs.size() == 1)
      images[task.task.frame()] = task.outputs.front();
  }
  std::set<FrameNumber> still_owned;
  if (owned != nullptr) still_owned.insert(owned->begin(), owned->end());

  // A frame belongs to the job that wrote it as long as its file is unchanged.
  const std::vector<std::string> picture = picture_differences(former.document, wanted);
  const FrameComparison comparison(former.document, wanted);
  std::set<std::string> differing;
  for (const FrameIndex mine : frames_with_something(former, images, locks.theirs)) {
    const FrameNumber number = theirs.frames[mine.index()];
    const auto image = images.find(mine);
    const std::optional<FrameIndex> place = frames.find(theirs, mine);
    if (!place && image == images.end() && is_open(status)) other.left_out.push_back(number);
    if (!place) continue;
    const FrameIndex its = *place;
    if (locks.theirs.contains(mine)) other.locked.push_back(number);
    const bool is_owned = owned == nullptr || still_owned.contains(number);
    const FileState state = is_owned && image != images.end()
                                ? files.judge(frame_path(theirs, mine), image->second).state
                                : FileState::absent;
    const bool is_there = state == FileState::right;
    other.has_place = other.has_place || is_open(status) || state != FileState::absent;
    if (locks.mine.contains(its)) continue;
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
  other.busy = is_open(status) && other.written.empty();
  return other;
}

}  // namespace baton
