#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/limits.h"
#include "common/job/text/job_json.h"

namespace baton {

/// What decides the pixels of a job, apart from its settings: those say which frames are made, in
/// which tiles, when, by whom, and how they are stored. Two jobs of one picture make the same bytes
/// of a frame that both have the same way up to there, and go on with each other's work.

/// Names what is so for all frames: every value of the job that is no setting and no key, the
/// contents of the meshes and, where samples are carried, the first frame, since the history begins
/// there. States and films say it.
Digest picture_digest(const JobSpec& job, const std::vector<AssetDigest>& assets);

/// What is so for all frames and differs: the JSON paths, and the files whose content changed;
/// sorted. Empty exactly when the picture digests are equal.
std::vector<std::string> picture_differences(const ParsedJobDocument& a,
                                             const ParsedJobDocument& b);
/// The settings that differ, but for names, frames and the priority: JSON paths, sorted.
std::vector<std::string> setting_differences(const JobSpec& a, const JobSpec& b);

/// What two jobs show in their frames, for jobs of one picture digest: the number of a frame, its
/// light with the contents of its maps, the camera and the poses of all that moves; where both show
/// motion, those at the frame numbers one less and one more, too. It looks at the frames that it is
/// asked about and, where samples are carried, at those before.
class FrameComparison {
 public:
  /// Both outlive it.
  FrameComparison(const ParsedJobDocument& a, const ParsedJobDocument& b);

  /// Whether frame `frame_a` of one and `frame_b` of the other have the same pixels: they are
  /// alike, and the means of as many sweeps.
  bool are_equal(FrameIndex frame_a, FrameIndex frame_b) const;
  /// Whether they show the same and, where samples are carried, so do all frames before; in later
  /// sweeps these are all frames.
  bool are_alike(FrameIndex frame_a, FrameIndex frame_b) const;
  /// Whether frames with the same pixels are laid over the same plate, or over none.
  bool have_one_plate(FrameIndex frame_a, FrameIndex frame_b) const;
  /// How many steps (common/job/plan/sequence.h) from the first on are the same in both; those from
  /// `end` on are not looked at.
  std::int32_t num_common_steps(Step end = Step(limits::kMaxTasksPerJob)) const;
  /// What differs in two frames that are not equal: "$.camera.keys", ...; "$.frames" where it is
  /// the frames before.
  std::string difference(FrameIndex frame_a, FrameIndex frame_b) const;

 private:
  struct Facts {
    Digest light, camera, objects;
    bool operator==(const Facts&) const = default;
  };
  /// The frames of one job.
  class Frames {
   public:
    explicit Frames(const ParsedJobDocument& document);
    std::size_t size() const { return facts_.size(); }
    FrameNumber number(FrameIndex frame) const { return document_->job.frames[frame.index()]; }
    std::size_t num_sweeps() const;
    /// with_motion: the same for all frames.
    const Facts& facts(FrameIndex frame, bool with_motion);
    /// A digest of zeros: none.
    Digest plate(FrameIndex frame) const;

   private:
    const ParsedJobDocument* document_;
    std::map<std::string, Digest> contents_;  ///< of assets, by path
    std::vector<const ObjectSpec*> moving_;
    std::vector<std::optional<Facts>> facts_;  ///< as far as they were asked for
  };

  bool show_the_same(FrameIndex frame_a, FrameIndex frame_b) const;
  bool have_common(std::size_t num_frames) const;
  bool are_all_common() const;

  mutable Frames a_, b_;
  bool with_motion_;  ///< both have the AOV
  bool carried_;
  /// Frames from the first on, as far as is known.
  mutable std::size_t num_common_ = 0;
};

}  // namespace baton
