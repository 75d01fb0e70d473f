#pragma once

#include <compare>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/limits.h"
#include "common/job/job_facts.h"
#include "common/job/job_spec.h"
#include "common/job/plan/timeline.h"
#include "common/job/time.h"
#include "common/math/pixel_blocks.h"
#include "common/math/pixel_rect.h"

namespace baton {

/// The environment at one frame: texels are scale lerp(map[map_a], map[map_b], mix), directions
/// are turned by `rotation` (world = rotation * map direction). Maps are indices into
/// JobSpec::environment.keys.
struct EnvironmentFrame {
  std::int32_t map_a = 0;
  std::int32_t map_b = 0;  ///< equal to map_a when mix is 0
  float mix = 0;           ///< [0, 1)
  /// Radiance factor beside EnvironmentSpec::scale, > 0.
  float scale = 1;
  Mat3 rotation;

  bool operator==(const EnvironmentFrame&) const = default;
  /// True when both frames show the same texels, whatever the rotation.
  bool same_texels(const EnvironmentFrame& b) const {
    return map_a == b.map_a && map_b == b.map_b && mix == b.mix && scale == b.scale;
  }
};

/// What the environment is at a frame; at least one key.
EnvironmentFrame environment_at(const EnvironmentSpec& environment, FrameNumber frame);
/// By how much it is turned about its axis, degrees.
double rotation_deg_at(const EnvironmentSpec& environment, FrameNumber frame);

/// What is particular to one step of the sequence.
struct FrameSpec {
  Step step{};
  FrameNumber number{1};
  /// Rounds of this frame that were rendered in earlier sweeps.
  std::int32_t first_round = 0;
  EnvironmentFrame environment;

  /// Number of a round among those of the frame over all sweeps: the address of its random numbers.
  std::int32_t round_of_frame(Round round) const { return first_round + round.value(); }
};

/// One FrameSpec per step of the job, in order.
std::vector<FrameSpec> expand_sequence(const JobSpec& job);

/// The rendered pixels cut into square tiles, row by row; border tiles are clipped. The first tile
/// begins at a multiple of kAlign pixels of the picture, wherever what is rendered of it begins,
/// and their side is one: all consist of whole blocks of the picture, in which pixels share.
class TileGrid {
 public:
  static constexpr std::int32_t kAlign = 8;
  static_assert(kAlign % PixelBlocks::kSide == 0 && kAlign % limits::kAdaptiveBlock == 0 &&
                kAlign % limits::kBounceBlock == 0);

  /// tile_size: > 0, rounded up to a multiple of kAlign.
  TileGrid(const PixelRect& image, int tile_size);
  explicit TileGrid(const ImageSpec& image) : TileGrid(image.rendered(), image.tile_size) {}

  std::int32_t count() const { return columns_ * rows_; }
  std::int32_t columns() const { return columns_; }
  std::int32_t rows() const { return rows_; }
  /// Side of a tile that no border clips.
  std::int32_t tile_size() const { return tile_size_; }
  /// tile in [0, count()).
  PixelRect rect(std::int32_t tile) const;
  /// The tiles that have a pixel within `reach_px` of one of `tile`, in either direction;
  /// ascending, with `tile` itself. The relation is symmetric.
  std::vector<std::int32_t> tiles_near(std::int32_t tile, std::int32_t reach_px) const;

 private:
  std::int32_t column_of(std::int32_t x) const { return (x - x0_) / tile_size_; }
  std::int32_t row_of(std::int32_t y) const { return (y - y0_) / tile_size_; }

  PixelRect image_;
  std::int32_t x0_, y0_;  ///< where the first tile would begin
  std::int32_t tile_size_, columns_, rows_;
};

/// The unit that a lease hands out: one tile for the steps of a run. Consecutive runs of a tile are
/// chained by the sample state when the job carries it.
struct TileRun {
  std::int32_t tile = 0;
  Run run{};
  StepSpan steps{};

  bool operator==(const TileRun&) const = default;
};
/// run in [0, num_runs(job)), tile in [0, TileGrid(job.image).count()).
TileRun tile_run(const JobSpec& job, std::int32_t tile, Run run);

/// At most `count` (> 1) of `frames`, evenly picked, the first and the last among them.
std::vector<FrameNumber> pick_frames(const std::vector<FrameNumber>& frames, std::size_t count);

/// Where a frame of the job is written.
std::filesystem::path frame_path(const JobSpec& job, FrameIndex frame);

}  // namespace baton
