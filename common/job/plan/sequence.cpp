#include "common/job/plan/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/job/key_span.h"

namespace baton {

namespace {

/// At least one key.
double value_at(const std::vector<NumberKey>& keys, double frame) {
  const KeySpan span = find_span(keys, frame);
  const double from = keys[span.from].value;
  return from + span.share * (keys[span.to].value - from);
}

}  // namespace

double rotation_deg_at(const EnvironmentSpec& environment, FrameNumber frame) {
  if (!environment.rotation_keys.empty()) return value_at(environment.rotation_keys, frame.value());
  return environment.rotation_start_deg +
         environment.rotation_deg_per_frame * (frame.value() - environment.rotation_start_frame);
}

EnvironmentFrame environment_at(const EnvironmentSpec& environment, FrameNumber frame) {
  const std::vector<EnvironmentKey>& keys = environment.keys;
  EnvironmentFrame result;

  // The last key at or before the frame counts; before the first key the first one does. Between
  // two keys the texels are mixed linearly.
  const KeySpan span = find_span(keys, frame.value());
  result.map_a = result.map_b = static_cast<std::int32_t>(span.from);
  if (environment.interpolate) result.mix = static_cast<float>(span.share);
  if (result.mix > 0) result.map_b = static_cast<std::int32_t>(span.to);
  if (!environment.scale_keys.empty())
    result.scale = static_cast<float>(value_at(environment.scale_keys, frame.value()));
  const double degrees = rotation_deg_at(environment, frame);
  if (degrees != 0) result.rotation = rotation_about(environment.rotation_axis, degrees);
  return result;
}

std::vector<FrameSpec> expand_sequence(const JobSpec& job) {
  std::vector<FrameSpec> frames;
  const Timeline timeline(job);
  frames.reserve(static_cast<std::size_t>(timeline.num_steps()));
  for (Step step; step.value() < timeline.num_steps(); ++step) {
    const FrameNumber number = job.frames[timeline.frame_of(step).index()];
    frames.push_back({.step = step,
                      .number = number,
                      .first_round = timeline.sweep_of(step).value() * job.quality.rounds,
                      .environment = environment_at(job.environment, number)});
  }
  return frames;
}

ImageSpec scaled(const ImageSpec& image, double scale) {
  const auto side = [&](int pixels) {
    return std::max(1, static_cast<int>(std::lround(pixels * scale)));
  };
  const auto low = [&](int edge, int limit) {
    return std::min(static_cast<int>(std::floor(edge * scale)), limit - 1);
  };
  const auto high = [&](int edge, int limit) {
    return std::min(static_cast<int>(std::ceil(edge * scale)), limit);
  };
  ImageSpec small = image;
  small.width = side(image.width);
  small.height = side(image.height);
  if (const auto& r = image.region)
    small.region = PixelRect{low(r->x0, small.width), low(r->y0, small.height),
                             high(r->x1, small.width), high(r->y1, small.height)};
  for (int* const pixels :
       {&small.overscan.left, &small.overscan.top, &small.overscan.right, &small.overscan.bottom})
    *pixels = static_cast<int>(std::ceil(*pixels * scale));
  return small;
}

namespace {

/// The last multiple of TileGrid::kAlign that is not past `x`, which may be negative.
std::int32_t aligned(std::int32_t x) {
  const std::int32_t rest = x % TileGrid::kAlign;
  return x - (rest < 0 ? rest + TileGrid::kAlign : rest);
}

}  // namespace

TileGrid::TileGrid(const PixelRect& image, int tile_size)
    : image_(image),
      x0_(aligned(image.x0)),
      y0_(aligned(image.y0)),
      tile_size_((tile_size + kAlign - 1) / kAlign * kAlign),
      columns_(column_of(image.x1 - 1) + 1),
      rows_(row_of(image.y1 - 1) + 1) {
  BATON_CHECK(image.width() > 0 && image.height() > 0 && tile_size > 0);
}

PixelRect TileGrid::rect(std::int32_t tile) const {
  BATON_CHECK(tile >= 0 && tile < count());
  const std::int32_t x0 = x0_ + tile % columns_ * tile_size_;
  const std::int32_t y0 = y0_ + tile / columns_ * tile_size_;
  return common_part({x0, y0, x0 + tile_size_, y0 + tile_size_}, image_);
}

std::vector<std::int32_t> TileGrid::tiles_near(std::int32_t tile, std::int32_t reach_px) const {
  const PixelRect near = grown(rect(tile), reach_px, image_);
  std::vector<std::int32_t> tiles;
  for (std::int32_t row = row_of(near.y0); row <= row_of(near.y1 - 1); ++row) {
    for (std::int32_t column = column_of(near.x0); column <= column_of(near.x1 - 1); ++column)
      tiles.push_back(row * columns_ + column);
  }
  return tiles;
}

TileRun tile_run(const JobSpec& job, std::int32_t tile, Run run) {
  return {tile, run, Timeline(job).steps_of(run)};
}

std::vector<FrameNumber> pick_frames(const std::vector<FrameNumber>& frames, std::size_t count) {
  if (frames.size() <= count) return frames;
  std::vector<FrameNumber> picked;
  for (std::size_t i = 0; i < count; ++i)
    picked.push_back(frames[i * (frames.size() - 1) / (count - 1)]);
  return picked;
}

std::filesystem::path frame_path(const JobSpec& job, FrameIndex frame) {
  const FrameNumber number = job.frames.at(frame.index());
  return std::filesystem::path(job.output.directory) /
         frame_file_name(job.output.pattern, number.value());
}

}  // namespace baton
