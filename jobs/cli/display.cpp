#include "jobs/cli/display.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "jobs/cli/choice_option.h"
#include "jobs/cli/text.h"

namespace baton {
namespace {

constexpr float kFarGrey = 0.1f;

/// The light of a pixel value in [0, 1], the inverse of what write_png does [IEC 61966-2-1].
float light_of(float value) {
  const float v = std::clamp(value, 0.0f, 1.0f);
  return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

/// The AOVs of a frame: `normal` of normal.X, normal.Y, normal.Z.
std::vector<std::string> aovs_of(const FilmTile& frame) {
  std::vector<std::string> names;
  for (const std::string& channel : frame.channels) {
    const std::string name = channel.substr(0, channel.rfind('.'));
    const bool is_color = channel == "R" || channel == "G" || channel == "B";
    if (!is_color && std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

/// The planes of an AOV: three, two or one; empty: it has no such channels.
std::vector<const float*> planes_of(const FilmTile& frame, const std::string& aov) {
  const std::string stem = aov.empty() ? "" : aov + ".";
  for (const std::string_view letters : {"RGB", "XYZ", "uv"}) {
    std::vector<const float*> planes;
    for (const char letter : letters) planes.push_back(frame.find(stem + letter));
    if (std::ranges::find(planes, nullptr) == planes.end()) return planes;
  }
  const float* const single = frame.find(aov);
  return single == nullptr ? std::vector<const float*>{} : std::vector{single};
}

RgbImage interleaved(const FilmTile& frame, const std::vector<const float*>& planes) {
  RgbImage image{frame.rect.width(), frame.rect.height(), {}};
  image.rgb.reserve(3 * frame.num_pixels());
  for (std::size_t i = 0; i < frame.num_pixels(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) image.rgb.push_back(planes[planes.size() == 3 ? c : 0][i]);
  }
  return image;
}

Display display_vectors(RgbImage image) {
  for (float& v : image.rgb) v = light_of((v + 1) / 2);
  return {std::move(image), "vectors as (v + 1) / 2"};
}

/// Motion in pixels, u red and v green; what stands still is grey.
Display display_motion(const FilmTile& frame, const std::vector<const float*>& uv,
                       const DisplayOptions& options) {
  float most = 0;
  for (const float* const plane : uv) {
    for (std::size_t i = 0; i < frame.num_pixels(); ++i)
      if (std::isfinite(plane[i])) most = std::max(most, std::fabs(plane[i]));
  }
  if (most == 0) most = 1;
  const auto [black, white] = options.range.value_or(std::pair{-most, most});
  const auto shown = [&](float v) {
    return light_of(std::isfinite(v) ? (v - black) / (white - black) : 0.5f);
  };
  RgbImage image{frame.rect.width(), frame.rect.height(), {}};
  for (std::size_t i = 0; i < frame.num_pixels(); ++i)
    image.rgb.insert(image.rgb.end(), {shown(uv[0][i]), shown(uv[1][i]), light_of(0.5f)});
  return {std::move(image),
          fmt::format("u red, v green, {:.4g} (dark) to {:.4g} (bright) pixels", black, white),
          std::pair{black, white}};
}

/// The smallest and largest of the finite values that are not 0; 0, 0 when there are none.
std::pair<float, float> range_of(const std::vector<float>& values) {
  std::optional<std::pair<float, float>> range;
  for (const float v : values) {
    if (!std::isfinite(v) || v == 0) continue;
    if (!range) range = {v, v};
    range = {std::min(range->first, v), std::max(range->second, v)};
  }
  return range.value_or(std::pair{0.0f, 0.0f});
}

Display display_depth(RgbImage image, const DisplayOptions& options) {
  const auto [near, far] = options.range.value_or(range_of(image.rgb));
  for (float& v : image.rgb) {
    const float share = far > near ? std::clamp((v - near) / (far - near), 0.0f, 1.0f) : 0;
    v = v > 0 && std::isfinite(v) ? light_of(1 - (1 - kFarGrey) * share) : 0;
  }
  return {std::move(image), fmt::format("depth {:.4g} (white) to {:.4g} (dark grey)", near, far),
          std::pair{near, far}};
}

/// What a hundredth of the values exceed, of those that are above 0; 1: none is.
float nearly_largest(std::vector<float> values) {
  std::erase_if(values, [](float v) { return !std::isfinite(v) || v <= 0; });
  if (values.empty()) return 1;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::ranges::nth_element(values, at);
  return *at;
}

/// Shares from 0 to 1. A variance has no such bound, and a few pixels far above the others.
Display display_numbers(RgbImage image, bool is_share, const DisplayOptions& options) {
  const auto [smallest, largest] = range_of(image.rgb);
  const float most = is_share ? std::max(largest, 1.0f) : nearly_largest(image.rgb);
  const float least = smallest < -1e-6f * most ? smallest : 0;  // but for what is rounded
  const auto [black, white] = options.range.value_or(std::pair{least, most});
  for (float& v : image.rgb) v = std::isfinite(v) ? light_of((v - black) / (white - black)) : 0;
  return {std::move(image), fmt::format("{:.4g} (black) to {:.4g} (white)", black, white),
          std::pair{black, white}};
}

/// The fit to the film curve of ACES, with its exposure: 1 becomes .80, 8 is nearly white
/// [Narkowicz 2015, "ACES Filmic Tone Mapping Curve"]. NaN gives 0.
float filmic(float v) {
  const float x = v > 0 ? std::min(v, 1e4f) : 0;
  return std::min(x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f), 1.0f);
}

}  // namespace

void add_radiance_options(CLI::App& command, DisplayOptions& options) {
  command
      .add_option("--exposure", options.stops,
                  "stops by which a picture is brighter, as in a viewer; default: 0")
      ->check(CLI::Range(-100.0, 100.0));
  add_choice_option<DisplayCurve>(
      command, "--curve", options.curve,
      {{"none", DisplayCurve::none}, {"filmic", DisplayCurve::filmic}},
      "none: what is brighter than 1 is white; filmic: bright light fades to white; default: none");
}

void add_aov_options(CLI::App& command, std::string& aov, DisplayOptions& options) {
  command.add_option("--aov", aov, "an AOV of the file, such as depth; default: the colours");
  using Range = std::pair<float, float>;
  const auto set_range = [&options](const Range& range) {
    if (!(range.first < range.second))
      throw CLI::ValidationError("--range", fmt::format("{} {}: expected a larger second number",
                                                        range.first, range.second));
    options.range = range;
  };
  command.add_option_function<Range>(
      "--range", set_range,
      "LOW HIGH: the numbers of an AOV that are black and white (depth: white and dark grey); "
      "default: 0 to 1, or by its values");
}

std::string radiance_text(const DisplayOptions& options) {
  const float stops = options.stops.value_or(0);
  return exposure_text(stops) + (stops == 0 ? "" : fmt::format(" (x{:.4g})", std::exp2(stops))) +
         (options.curve == DisplayCurve::filmic ? ", filmic curve" : "");
}

Display display_radiance(RgbImage image, const DisplayOptions& options) {
  const float factor = std::exp2(options.stops.value_or(0));
  for (float& v : image.rgb) {
    v *= factor;
    if (options.curve == DisplayCurve::filmic) v = filmic(v);
  }
  return {std::move(image), radiance_text(options)};
}

Result<Display> display_aov(const FilmTile& frame, const std::string& aov,
                            const DisplayOptions& options) {
  const std::vector<const float*> planes = planes_of(frame, aov);
  if (planes.empty()) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}; there is {}",
                             aov.empty() ? "no channels R, G and B; see --aov"
                                         : "--aov " + aov + ": no such AOV in the file",
                             fmt::join(aovs_of(frame), ", "))};
  }
  if (planes.size() == 2) return display_motion(frame, planes, options);
  RgbImage image = interleaved(frame, planes);
  const bool is_vector = planes.size() == 3 && frame.find(aov + ".X") == planes[0];
  const bool is_share = aov != "variance";
  const bool is_radiance = (planes.size() == 3 && is_share) || aov == "lns" || options.stops;
  if (is_vector) return display_vectors(std::move(image));
  if (is_radiance && !options.range) return display_radiance(std::move(image), options);
  if (aov == "depth" || aov == "Z") return display_depth(std::move(image), options);
  return display_numbers(std::move(image), is_share, options);
}

}  // namespace baton
