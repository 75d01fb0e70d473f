#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/job/text/picture.h"
#include "coordinator/schedule/events.h"

namespace baton {

/// A job that writes, or has written, the picture of a new one into the same folder.
struct FormerJob {
  ParsedJobDocument document;  ///< with job.leading_runs
  std::vector<Completions::Task> tasks;
  JobPlan plan;
  JobStatus status = JobStatus::running;
  std::map<FrameIndex, FrameStats> frames = {};  ///< what assemblies saw
  std::string renderer = {};                     ///< of what is done of it; empty: not known
  bool is_mixed = false;                         ///< others have made some of it, too
};

/// What is there of what former jobs have made.
struct KeptFiles {
  /// Whether the file of this frame of the new job has this size and digest.
  std::function<bool(FrameIndex frame, const BlobRef& image)> has_frame;
  std::function<bool(const BlobRef& blob)> has_blob;
  /// Frames of the new job that count as written, whatever is in their files.
  std::set<FrameIndex> locked = {};
};

/// What a new job need not do.
struct Adoption {
  /// Frames that are written, as assemblies of the new job: with what was seen of them, whichever
  /// job wrote them.
  std::vector<Completion> frames;
  std::optional<std::size_t> former;  ///< whose work goes on
  /// Tasks of `former` that count as the new job's, under their keys.
  std::vector<TaskKey> tasks;
  /// Done without outputs until something of them is needed.
  std::vector<TaskKey> skipped;
  JobPlan plan;
  /// Frames are written anew, as they lie over other plates.
  bool other_plates = false;
  /// Frames that were written and are not there.
  std::vector<FrameIndex> lost;
  /// Those of them in whose place a former job has written another way.
  std::set<FrameIndex> overwritten;
  /// The newest former job that has, or else whose frames are kept.
  std::optional<std::size_t> beside;
  /// The former jobs of which something is kept. Locked frames are nobody's here.
  std::set<std::size_t> kept_of;

  bool empty() const { return frames.empty() && tasks.empty() && plan.cuts.empty(); }
};

/// Whether frames are written alike: in the same channels, format and names. What stands in headers
/// alone may differ.
bool writes_alike(const JobSpec& one, const JobSpec& other);

/// What jobs of one picture leave to a new one.
///
/// A frame is kept if its pixels are the same (FrameComparison), it is written alike and its file
/// is as it was written. Of the former job that has come farthest, all tasks of the frames in
/// common count where tiles and films are the same. With other tiles its states are cut and joined:
/// those of the newest frame of which all are there, before the first frame that is to be written.
/// Tasks of runs whose frames are all kept are skipped.
Adoption adopt(const ParsedJobDocument& wanted, const std::vector<FormerJob>& formers,
               const KeptFiles& files);

}  // namespace baton
