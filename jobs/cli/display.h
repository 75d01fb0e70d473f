#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "common/image/image_io.h"

namespace baton {

/// What happens to radiance before it is shown. none: what is brighter than 1 is white.
enum class DisplayCurve : std::uint8_t { none, filmic };

/// How a picture becomes one of 8 bits a channel.
struct DisplayOptions {
  std::optional<float> stops{};  ///< radiance times 2^stops; none: 0
  DisplayCurve curve = DisplayCurve::none;
  /// Values of data that are black and white; none: its own range.
  std::optional<std::pair<float, float>> range{};
};

/// A picture for write_png, and what was done to it, for people.
struct Display {
  RgbImage image;
  /// "exposure +2 stops (x4)", "depth 1.2 (white) to 7.5 (dark grey)".
  std::string how;
  std::optional<std::pair<float, float>> range{};  ///< black and white, where it is data
};

/// Adds --exposure and --curve.
void add_radiance_options(CLI::App& command, DisplayOptions& options);
/// Adds --aov, and --range.
void add_aov_options(CLI::App& command, std::string& aov, DisplayOptions& options);

/// Radiance as a viewer shows it at this exposure and through this curve, black behind what is
/// transparent.
Display display_radiance(RgbImage image, const DisplayOptions& options);
/// "exposure +2 stops, filmic curve".
std::string radiance_text(const DisplayOptions& options);

/// A frame's colours ("") or the named AOV. Colours and `lns` are shown as radiance. Vectors are
/// shown as (v + 1) / 2, motion with u as red and v as green. Single numbers go from 0, black, to
/// 1, white, or to the largest where that is larger; `depth` from the nearest, white, to the
/// farthest, dark grey, with black where nothing is. Data has no display curve: pixel value 128 is
/// the middle. Errors: no such AOV, with those that there are.
Result<Display> display_aov(const FilmTile& frame, const std::string& aov,
                            const DisplayOptions& options);

}  // namespace baton
