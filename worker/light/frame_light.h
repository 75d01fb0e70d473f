#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "common/base/lru_cache.h"
#include "common/base/result.h"
#include "common/job/plan/sequence.h"
#include "worker/light/irradiance.h"
#include "worker/light/map_cache.h"
#include "worker/light/presampled_light.h"
#include "worker/surface/environment.h"
#include "worker/surface/hidden_light.h"

namespace baton {

/// The light of one round of a frame, ready for its pixels.
struct FrameLight {
  Environment now;
  Environment seen{};  ///< by the camera, where it sees no surface
  /// The frame before; for the first frame, and for its later rounds, the same as now.
  Environment before;
  /// now shows what before showed: the same texels, turned alike. Not in later rounds: they must
  /// not repeat the first one.
  bool still = false;
  /// How directions turn with the light from the frame before to now, if that is all that it does;
  /// see turn_between()
  std::optional<Mat3> turn;
  std::shared_ptr<const PresampledSets> presampled;
  /// What arrives without shadows, of jobs with shadow catchers. `before` where samples are
  /// carried.
  std::shared_ptr<const Irradiance> irradiance{}, irradiance_before{};
};

/// R_now R_before^-1 of a map whose texels stay: along it, directions on the lattice are carried
/// with their light. None for turns below 0.06 degrees, of which the lattice could swallow more
/// than a fifteenth, and with `nearest`: there a direction that is rounded into the next texel has
/// another light at once.
std::optional<Mat3> turn_between(const Environment& before, const Environment& now);

/// The round whose presampled light and random numbers no image has (noise_probe.h).
inline constexpr Round kProbeRound(1 << 30);

/// The environments of a job's frames, prepared on demand. What is made for a frame is kept while
/// memory allows, of as many frames as tasks in hand may ask for. Any number of threads may ask; a
/// frame is prepared once by all who wait for light. A frame's light is a pure function of (job,
/// frame, round).
class LightSequence {
 public:
  /// job must outlive the object. maps: may be shared with other jobs. share: of what it makes.
  /// hidden: what lights no surface; null: nothing.
  LightSequence(const JobSpec& job, std::shared_ptr<MapCache> maps, const MemorySharePtr& share,
                std::shared_ptr<const HiddenLight> hidden = nullptr);

  /// The light of a step in a round, or of kProbeRound. Errors: a map that cannot be read, or two
  /// key frames of different size.
  Result<std::shared_ptr<const FrameLight>> at(Step step, Round round = Round(0));

  /// What people should know of the maps read so far, and of jumps of the light from one frame to
  /// the next, a line each.
  std::vector<std::string> notes() const;

 private:
  std::shared_ptr<const FrameLight> known(Step step, Round round);
  Result<std::shared_ptr<const FrameLight>> make(Step step, Round round, const DoParts& do_parts);
  Step first_with_texels_of(const EnvironmentFrame& frame) const;
  std::shared_ptr<const Irradiance> irradiance(const EnvironmentFrame& frame,
                                               const Environment& environment);
  Result<std::shared_ptr<const EnvironmentMap>> key_map(std::int32_t key, const HiddenCone& hidden,
                                                        const DoParts& do_parts);
  Result<std::shared_ptr<const EnvironmentMap>> mixed_map(const EnvironmentFrame& frame,
                                                          const HiddenCone& hidden,
                                                          const DoParts& do_parts);
  HiddenCone hidden_in(const FrameSpec& frame);
  Result<Environment> environment(const FrameSpec& frame, const DoParts& do_parts);
  Result<Environment> seen_environment(const Environment& now);
  void note(const FrameSpec& frame);

  const JobSpec& job_;
  const std::shared_ptr<MapCache> maps_;
  const std::shared_ptr<const HiddenLight> hidden_;
  std::vector<std::optional<HiddenCone>> cones_;  ///< (frames), of those that were asked for
  std::vector<FrameSpec> frames_;
  const std::int32_t num_sets_;  ///< sets of presampled light
  const float capped_share_;     ///< of the tables of maps (EnvironmentMap)
  /// Whose turn it is makes light.
  Team team_;
  std::mutex known_mutex_;
  /// As long as somebody has it.
  std::map<std::pair<Step, Round>, std::weak_ptr<const FrameLight>> known_;
  mutable std::mutex notes_mutex_;
  /// By the first step that shows these texels, and what is hidden of them.
  LruCache<std::pair<Step, HiddenCone>, EnvironmentMap> mixed_maps_;
  LruCache<std::pair<Step, Round>, PresampledSets> presampled_;
  LruCache<Step, Irradiance> irradiances_;  ///< by the first step with these texels
  std::set<Step> noted_;                    ///< steps that notes_ has
  std::set<std::int32_t> noted_keys_;       ///< keys that notes_ has
  std::size_t num_jumps_ = 0;               ///< jumps of the light in notes_
  std::vector<std::string> notes_;
};

}  // namespace baton
