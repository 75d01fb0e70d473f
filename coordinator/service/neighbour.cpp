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
namespace {

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

}  // namespace

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

Neighbour look_at(const FormerJob& former, const Digest& job, const ParsedJobDocument& wanted,
                  const FileTable& files, const std::vector<FrameNumber>* owned,
                  const Locks& locks) {
  const JobStatus status = former.status;
  Neighbour other{.job = job, .status = status};
  const JobSpec& theirs = former.document.job;
  std::map<FrameIndex, BlobRef> images;
  for (const Completions::Task& task : former.tasks) {
    if (task.task.kind == TaskKind::assemble && task.outputs.size() == 1)
      images[task.task.frame()] = task.outputs.front();
  }

  // One that ended before it had a frame has no place: there may be many, of many frames each.
  if (!is_open(status) && images.empty() && locks.theirs.frames().empty()) return other;

  // A frame belongs to the job that wrote it as long as its file is unchanged.
  const auto shared = shared_frames(theirs, wanted.job);
  const std::vector<std::string> picture = picture_differences(former.document, wanted);
  const FrameComparison comparison(former.document, wanted);
  std::set<std::string> differing;
  for (const auto& [mine, its] : shared) {
    if (locks.theirs.contains(mine)) other.locked.push_back(theirs.frames[mine.index()]);
    const auto image = images.find(mine);
    const bool is_owned =
        owned == nullptr ||
        std::find(owned->begin(), owned->end(), theirs.frames[mine.index()]) != owned->end();
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
  const std::map<FrameIndex, FrameIndex> in_both(shared.begin(), shared.end());
  for (FrameIndex frame; frame.index() < theirs.frames.size(); ++frame) {
    if (!in_both.contains(frame) && !images.contains(frame))
      other.left_out.push_back(theirs.frames[frame.index()]);
  }
  return other;
}

}  // namespace baton
