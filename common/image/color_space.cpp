#include "common/image/color_space.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "common/image/openexr_colors.h"

namespace baton {
namespace {

/// Headers round.
constexpr float kSame = 1e-3f;

/// OpenEXR multiplies row vectors.
Mat3 of_columns(const Imath::M44f& m) {
  return {{m[0][0], m[1][0], m[2][0], m[0][1], m[1][1], m[2][1], m[0][2], m[1][2], m[2][2]}};
}

Vec3 xyz_of(const std::array<float, 2>& xy) {
  return {xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]};
}

bool nearly(const Chromaticities& a, const Chromaticities& b) {
  const auto near = [](const std::array<float, 2>& p, const std::array<float, 2>& q) {
    return std::fabs(p[0] - q[0]) <= kSame && std::fabs(p[1] - q[1]) <= kSame;
  };
  return near(a.red, b.red) && near(a.green, b.green) && near(a.blue, b.blue) &&
         near(a.white, b.white);
}

std::string xy_text(const std::array<float, 2>& xy) {
  return fmt::format("({:.4g}, {:.4g})", xy[0], xy[1]);
}

std::string space_text(const Chromaticities& c) {
  return fmt::format("red {}, green {}, blue {}, white {}", xy_text(c.red), xy_text(c.green),
                     xy_text(c.blue), xy_text(c.white));
}

}  // namespace

Result<std::optional<Mat3>> to_rec709(const Chromaticities& from) {
  const Chromaticities rec709;
  if (nearly(from, rec709)) return std::optional<Mat3>();

  // Responses of the eye, as Bradford has them, and back.
  constexpr Mat3 kCones{
      {0.8951f, 0.2664f, -0.1614f, -0.7502f, 1.7135f, 0.0367f, 0.0389f, -0.0685f, 1.0296f}};
  constexpr Mat3 kXyz{{0.9869929f, -0.1470543f, 0.1599627f, 0.4323053f, 0.5183603f, 0.0492912f,
                       -0.0085287f, 0.0400428f, 0.9684867f}};
  std::optional<Mat3> whole;
  try {
    const Vec3 a = kCones * xyz_of(from.white), b = kCones * xyz_of(rec709.white);
    const Mat3 adapt{{b.x / a.x, 0, 0, 0, b.y / a.y, 0, 0, 0, b.z / a.z}};
    whole = of_columns(Imf::XYZtoRGB(to_openexr(rec709), 1)) * (kXyz * (adapt * kCones)) *
            of_columns(Imf::RGBtoXYZ(to_openexr(from), 1));
  } catch (const std::exception&) {
    // Three primaries on a line, or none at all.
  }
  if (!whole || !std::ranges::all_of(whole->m, [](float v) { return std::fabs(v) < 1e3f; }))
    return Error{
        ErrorKind::bad_input,
        fmt::format("chromaticities: expected those of a color space, got {}", space_text(from))};
  return whole;
}

bool is_unknown(const Chromaticities& c) {
  return c == Chromaticities{.red = {0, 0}, .green = {0, 0}, .blue = {0, 0}, .white = {0, 0}};
}

Status convert_to_rec709(std::span<float> pixels, std::size_t channels, const ImageColors& from) {
  std::optional<Mat3> matrix = of_columns(Imf::XYZtoRGB(to_openexr(Chromaticities()), 1));
  if (!from.is_xyz) {
    BATON_ASSIGN(matrix, to_rec709(from.chromaticities));
  }
  const Rgb& f = from.factor;
  if (!matrix && f == Rgb{1, 1, 1}) return {};
  for (; pixels.size() >= channels; pixels = pixels.subspan(channels)) {
    Rgb color{pixels[0] / f.x, pixels[1] / f.y, pixels[2] / f.z};
    if (matrix) color = *matrix * color;
    pixels[0] = color.x;
    pixels[1] = color.y;
    pixels[2] = color.z;
  }
  return {};
}

std::string conversion_text(const ImageColors& colors) {
  std::string text;
  if (colors.is_xyz)
    text = "to Rec. 709, from CIE XYZ";
  else if (!nearly(colors.chromaticities, {}))
    text = fmt::format("to Rec. 709, from {}", space_text(colors.chromaticities));
  const Rgb& f = colors.factor;
  if (f == Rgb{1, 1, 1}) return text;
  return text + (text.empty() ? "" : "; ") +
         (f.x == f.y && f.y == f.z
              ? fmt::format("divided by its exposure, {:.4g}", f.x)
              : fmt::format("divided by its exposure, ({:.4g}, {:.4g}, {:.4g})", f.x, f.y, f.z));
}

}  // namespace baton
