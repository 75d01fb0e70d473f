#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "common/job/task.h"
#include "worker/bounce/bounce_walk.h"
#include "worker/method/pixel_method.h"
#include "worker/pass/catcher_albedo.h"
#include "worker/pass/film_writer.h"
#include "worker/pass/noise_probe.h"
#include "worker/pass/pixel_order.h"
#include "worker/pass/primary.h"

namespace baton {

class Reprojection;

/// One pass over some pixels of a tile.
struct TileRound {
  const FrameSpec& frame;
  Round round{};
  const FrameLight& light;
  const TileSurfaces& surfaces;  ///< what its sites see
  const PixelOrder& order;       ///< in which its slots are worked on
  /// The light that probes are sampled again with; null: there are none.
  const FrameLight* probe_light = nullptr;
  /// What the previous frame left, in the first round where surfaces move: the state is all zero.
  /// Else null.
  Reprojection* history = nullptr;
  /// Pixels stay, and the state is what the round or frame before left.
  bool goes_on = false;

  /// How many rounds of the sequence come before it, of num_rounds a step; less than 0 before those
  /// that are seen. To a method a round is a frame of standing light.
  std::int32_t rounds_before(std::int32_t num_rounds) const {
    return frame.step.value() * num_rounds + round.value();
  }
};

/// Wall seconds of the stages.
struct StageSeconds {
  double history = 0, sample = 0, trace = 0, shade = 0;
};

/// A TileRound at work: what all its stages read, and what they count.
struct RoundWork {
  RoundWork(const RenderContext& context, const TileRound& round);

  RngKey key(std::size_t index) const;
  bool is_probe(std::size_t index) const;
  /// Who shares light between surfaces with a pixel.
  BounceGroup group(std::size_t index) const;

  const TileRound& at;
  const JobSpec& job;
  RoundLight light;
  std::optional<RoundLight> probe_light;
  /// Albedo in the light of this frame, and in that of the frame before.
  CatcherAlbedo catchers, catchers_before;
  StageSeconds seconds;
  SamplingStats sampling;
};

/// The pixels in work, so few that they stay in the cache, with what one stage hands to the next.
struct PixelBatch {
  static constexpr std::size_t kMost = 64;
  template <class T>
  using Column = std::array<T, kMost>;

  std::span<const std::uint32_t> slots;  ///< of the round, at most kMost
  RayBatch rays;
  Column<std::size_t> end_ray;       ///< where each pixel's rays end
  Column<KnownLight> known;          ///< what its method knows
  Column<PixelResult> pixels;        ///< what the film gets
  Column<Rgb> emission;              ///< emission of what pixels see
  Column<std::optional<Rgb>> again;  ///< radiance once more, where it is wanted
  /// What comes by other surfaces; then once more, as `again`; then on the sites on catchers of
  /// pixels that belong to objects.
  std::array<Rgb, 3 * kMost> indirect;
  static constexpr std::size_t kAgain = kMost, kOnEdge = 2 * kMost;  ///< where these begin
  /// Groups of the pixels that are drawn again.
  std::vector<BounceGroup> groups_again;

  std::size_t count() const { return slots.size(); }
  bool has_again(const BounceGroup& group) const {
    return std::ranges::any_of(groups_again,
                               [&](const BounceGroup& one) { return one.is_same(group); });
  }
  /// Makes room for other pixels.
  void begin(std::span<const std::uint32_t> new_slots);
};

}  // namespace baton
