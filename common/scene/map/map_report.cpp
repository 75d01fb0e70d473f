#include "common/scene/map/map_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "common/job/plan/sequence.h"
#include "common/math/vec3.h"
#include "common/scene/map/map_reduction.h"
#include "common/scene/map/map_texel.h"

namespace baton {
namespace {

/// Factor by which the light's mean changes in a jump.
constexpr float kJump = 2;

/// What the texels of a picture are, one by one.
struct TexelReport {
  /// Mean over the sphere and the three channels, of what is finite and positive.
  double mean = 0;
  float brightest = 0;
  std::uint64_t repaired = 0;  ///< those with a channel that is no radiance
};

TexelReport look_at_texels(const RgbImage& image, float scale) {
  const auto row_values = static_cast<std::size_t>(3 * image.width);
  TexelReport report;
  double sum = 0, weights = 0;
  for (int y = 0; y < image.height; ++y) {
    const auto row =
        std::span(image.rgb).subspan(static_cast<std::size_t>(y) * row_values, row_values);
    double row_sum = 0;
    for (const float v : row) {
      if (!std::isfinite(v) || v <= 0) continue;
      row_sum += v;
      report.brightest = std::max(report.brightest, v);
    }
    for (std::size_t i = 0; i < row_values; i += 3) {
      const bool is_whole = is_radiance(row[i], scale) && is_radiance(row[i + 1], scale) &&
                            is_radiance(row[i + 2], scale);
      report.repaired += is_whole ? 0 : 1;
    }
    const double weight = std::sin((y + 0.5) * double{kPi} / image.height);
    sum += weight * row_sum;
    weights += weight * static_cast<double>(row_values);
  }
  report.mean = weights > 0 ? sum / weights : 0.0;
  return report;
}

}  // namespace

MapReport report_map(const std::string& path, const RgbImage& image, float scale, int max_width) {
  const TexelReport texels = look_at_texels(image, scale);
  const auto [width, height] = map_sides(image.width, image.height, max_width);
  return {.path = path,
          .width = width,
          .height = height,
          .file_width = image.width,
          .file_height = image.height,
          .repaired_texels = texels.repaired,
          .black = !(texels.mean * double{scale} > 0),
          .brightest = texels.brightest,
          .mean = static_cast<float>(texels.mean),
          .colors = {},
          .notes = image.notes};
}

std::vector<std::string> texel_warnings(const MapReport& map) {
  std::vector<std::string> warnings;
  for (const std::string& note : map.notes)
    warnings.push_back(fmt::format("{}: {}", map.path, note));
  if (map.repaired_texels > 0)
    warnings.push_back(fmt::format("{}: {} texels are negative, NaN or infinite and count as 0",
                                   map.path, map.repaired_texels));
  return warnings;
}

std::vector<std::string> light_warnings(const MapReport& map) {
  std::vector<std::string> warnings;
  const auto add = [&](const std::string& text) { warnings.push_back(map.path + ": " + text); };
  if (map.black) {
    add("the map is black: nothing will be lit");
  } else if (map.brightest <= 1) {
    add(
        fmt::format("no texel is brighter than 1 ({:.3g}): a picture of low dynamic range? Its "
                    "lamps and its sun are then too dark",
                    map.brightest));
  }
  if (map.file_width != 2 * map.file_height) {
    add(
        fmt::format("{}x{} texels, a lat-long map is twice as wide as high: the light will be "
                    "distorted",
                    map.file_width, map.file_height));
  }
  return warnings;
}

std::optional<std::string> light_jump(const EnvironmentSpec& environment, FrameNumber from,
                                      FrameNumber to,
                                      const std::function<float(std::int32_t key)>& mean) {
  if (to != from + 1) return std::nullopt;  // frames between them were left out on purpose
  const EnvironmentFrame a = environment_at(environment, from), b = environment_at(environment, to);
  const auto level = [&](const EnvironmentFrame& at) {
    return (1 - at.mix) * mean(at.map_a) + at.mix * mean(at.map_b);
  };
  const auto map = [&](std::int32_t key) {
    return environment.keys[static_cast<std::size_t>(key)].map;
  };
  const float before = level(a), after = level(b);
  const float ratio = before > 0 ? after / before : 1.0f;
  if (ratio > kJump || ratio * kJump < 1)
    return fmt::format("the light jumps from frame {} to {}: {:.3g} times as bright", from, to,
                       ratio);
  if (environment.interpolate && a.mix == 0 && b.mix == 0 && map(a.map_a) != map(b.map_a))
    return fmt::format("the light jumps from frame {} to {}: another map", from, to);
  return std::nullopt;
}

}  // namespace baton
