#include "worker/scene/environment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "common/base/check.h"

namespace baton {
namespace {

constexpr double kPiDouble = 3.14159265358979323846;

/// Compensation that leaves less than this share of the power is noise: the map is constant.
constexpr double kMinCompensatedShare = 1e-5;

/// A channel that is fit to be radiance; what is not is counted in `kind`: 0 good, 1 negative, 2
/// infinite, 3 NaN.
float repaired(float value, int& kind) {
  if (value >= 0 && value <= std::numeric_limits<float>::max()) return value;
  kind = std::max(kind, std::isnan(value) ? 3 : value < 0 ? 1 : 2);
  return 0;
}

double mean_rgb(const EnvironmentMap::Texel& t) {
  return (static_cast<double>(t.r) + t.g + t.b) * (1.0 / 3.0);
}

/// Solid angle between two polar angles, cos a - cos b without cancellation, times 2 pi.
double zone_solid_angle(double a, double b) {
  return 4 * kPiDouble * std::sin(0.5 * (a + b)) * std::sin(0.5 * (b - a));
}

/// Index of the non-empty interval of the cumulative sums that holds u * sum, and how far through
/// it, kept `margin` away from both ends.
int invert_cdf(std::span<const double> cdf, float u, double margin, double& remainder) {
  const double x = u * cdf.back();
  const auto upper = std::upper_bound(cdf.begin(), cdf.end(), x);
  const auto lower = upper - 1;
  remainder = std::clamp((x - *lower) / (*upper - *lower), margin, 1 - margin);
  return static_cast<int>(lower - cdf.begin());
}

}  // namespace

EnvironmentMap::EnvironmentMap(const RgbImage& image, MapFilter filter, float scale,
                               bool compensate)
    : width_(image.width), height_(image.height), filter_(filter) {
  BATON_CHECK(width_ > 0 && height_ > 0);
  BATON_CHECK(image.rgb.size() == std::size_t{3} * static_cast<std::size_t>(width_) * height_);
  texels_.resize(static_cast<std::size_t>(stride()) * (height_ + 2));

  // Copy the rows, zero what is no radiance.
  const float* source = image.rgb.data();
  for (int j = 0; j < height_; ++j) {
    Texel* row = &texels_[static_cast<std::size_t>(j + 1) * stride() + 1];
    for (int i = 0; i < width_; ++i, source += 3) {
      int kind = 0;
      row[i].r = repaired(source[0] * scale, kind);
      row[i].g = repaired(source[1] * scale, kind);
      row[i].b = repaired(source[2] * scale, kind);
      repairs_.negative += kind == 1;
      repairs_.infinite += kind == 2;
      repairs_.nan += kind == 3;
    }

    // Wrap around horizontally.
    row[-1] = row[width_ - 1];
    row[width_] = row[0];
  }

  // Repeat the first and the last row.
  std::copy_n(texels_.begin() + stride(), stride(), texels_.begin());
  std::copy_n(texels_.end() - 2 * stride(), stride(), texels_.end() - stride());
  build_table(compensate);
}

EnvironmentMap::EnvironmentMap(const EnvironmentMap& a, const EnvironmentMap& b, float t,
                               bool compensate)
    : width_(a.width_), height_(a.height_), filter_(a.filter_) {
  BATON_CHECK(a.width_ == b.width_ && a.height_ == b.height_ && a.filter_ == b.filter_);
  texels_.resize(a.texels_.size());
  for (std::size_t i = 0; i < texels_.size(); ++i) {
    const Texel& p = a.texels_[i];
    const Texel& q = b.texels_[i];
    texels_[i] = {(1 - t) * p.r + t * q.r, (1 - t) * p.g + t * q.g, (1 - t) * p.b + t * q.b, 0};
  }
  build_table(compensate);
}

int EnvironmentMap::cell_rows() const { return height_ + (filter_ == MapFilter::bilinear ? 1 : 0); }

double EnvironmentMap::row_angle(int row) const {
  const double shift = filter_ == MapFilter::bilinear ? 0.5 : 0.0;
  return std::clamp((row - shift) / height_, 0.0, 1.0) * kPiDouble;
}

std::size_t EnvironmentMap::cell_row(int row) const {
  const int padded_row = filter_ == MapFilter::bilinear ? row : row + 1;
  return static_cast<std::size_t>(padded_row) * stride() + 1;
}

double EnvironmentMap::cell_means(int row, double* cell) const {
  const Texel* upper = &texels_[cell_row(row)];
  double sum = 0;
  if (filter_ == MapFilter::nearest) {
    for (int i = 0; i < width_; ++i) sum += cell[i + 1] = mean_rgb(upper[i]);
    return sum;
  }
  const Texel* lower = upper + stride();
  double left = mean_rgb(upper[0]) + mean_rgb(lower[0]);
  for (int i = 0; i < width_; ++i) {
    const double right = mean_rgb(upper[i + 1]) + mean_rgb(lower[i + 1]);
    sum += cell[i + 1] = 0.25 * (left + right);
    left = right;
  }
  return sum;
}

void EnvironmentMap::build_table(bool compensate) {
  // Measure every cell and the map's power.
  const int rows = cell_rows();
  const std::size_t pitch = static_cast<std::size_t>(width_) + 1;
  cell_cdf_.resize(static_cast<std::size_t>(rows) * pitch);
  std::vector<double> solid_angle(static_cast<std::size_t>(rows));
  for (int r = 0; r < rows; ++r) {
    solid_angle[r] = zone_solid_angle(row_angle(r), row_angle(r + 1)) / width_;
    total_power_ += cell_means(r, &cell_cdf_[r * pitch]) * solid_angle[r];
  }

  // Find what the table leaves out, and what remains.
  double offset = compensate ? total_power_ / (4 * kPiDouble) : 0.0;
  double table_power = total_power_;
  if (compensate) {
    table_power = 0;
    for (int r = 0; r < rows; ++r) {
      double sum = 0;
      for (int i = 1; i <= width_; ++i) sum += std::max(0.0, cell_cdf_[r * pitch + i] - offset);
      table_power += sum * solid_angle[r];
    }
    if (table_power < kMinCompensatedShare * total_power_) {
      offset = 0;
      table_power = total_power_;
    }
  }

  // Turn radiance into cumulative sums and densities; a cell that can be drawn has a positive
  // density.
  const double inverse_power = table_power > 0 ? 1 / table_power : 0.0;
  row_cdf_.assign(static_cast<std::size_t>(rows) + 1, 0.0);
  for (int r = 0; r < rows; ++r) {
    Texel* texel = &texels_[cell_row(r)];
    double* cell = &cell_cdf_[r * pitch];
    double sum = cell[0] = 0;
    for (int i = 0; i < width_; ++i) {
      const double weight = std::max(0.0, cell[i + 1] - offset);
      const auto density = static_cast<float>(weight * inverse_power);
      texel[i].density = weight > 0 ? std::max(density, std::numeric_limits<float>::min()) : 0.0f;
      cell[i + 1] = sum += weight;
    }
    texel[-1].density = texel[width_ - 1].density;
    texel[width_].density = texel[0].density;
    row_cdf_[r + 1] = row_cdf_[r] + sum * solid_angle[r];
  }
}

EnvironmentMap::Texel EnvironmentMap::evaluate(const Vec3& w) const {
  // Find the place in texels.
  const float longitude = std::atan2(w.x, w.z);
  const float polar = std::atan2(std::sqrt(w.x * w.x + w.z * w.z), w.y);
  const float x = (0.5f - longitude * (0.5f * kInvPi)) * static_cast<float>(width_);
  const float y = polar * kInvPi * static_cast<float>(height_);
  const auto texel = [this](int i, int j) {
    return &texels_[static_cast<std::size_t>(j + 1) * stride() + static_cast<std::size_t>(i + 1)];
  };
  if (filter_ == MapFilter::nearest) {
    const int i = std::clamp(static_cast<int>(x), 0, width_ - 1);
    return *texel(i, std::min(static_cast<int>(y), height_ - 1));
  }

  // Interpolate the four corners of the dual cell.
  const int i = std::clamp(static_cast<int>(std::floor(x - 0.5f)), -1, width_ - 1);
  const int j = std::min(static_cast<int>(std::floor(y - 0.5f)), height_ - 1);
  const float fx = x - 0.5f - static_cast<float>(i);
  const float fy = y - 0.5f - static_cast<float>(j);
  const Texel* a = texel(i, j);
  const Texel* b = a + stride();
  const auto blend = [fx, fy](float ul, float ur, float ll, float lr) {
    return (1 - fy) * ((1 - fx) * ul + fx * ur) + fy * ((1 - fx) * ll + fx * lr);
  };
  return {blend(a[0].r, a[1].r, b[0].r, b[1].r), blend(a[0].g, a[1].g, b[0].g, b[1].g),
          blend(a[0].b, a[1].b, b[0].b, b[1].b), a->density};
}

Vec3 EnvironmentMap::sample(const std::array<float, 2>& u) const {
  BATON_CHECK(row_cdf_.back() > 0);

  // Choose row, then cell; the margin keeps a direction that is rounded to float inside its cell.
  const double margin = std::min(0.25, std::max(width_, height_) * 0x1p-21);
  double down = 0;
  double right = 0;
  const int row = invert_cdf(row_cdf_, u[0], margin, down);
  const std::size_t pitch = static_cast<std::size_t>(width_) + 1;
  const int column =
      invert_cdf(std::span(cell_cdf_).subspan(row * pitch, pitch), u[1], margin, right);

  // Place the direction uniformly in the cell's solid angle.
  const double top = row_angle(row);
  const double drop = zone_solid_angle(top, row_angle(row + 1)) / (2 * kPiDouble);
  const double y = std::cos(top) - drop * down;
  const double sin_polar = std::sqrt(std::max(0.0, (1 - y) * (1 + y)));
  const double shift = filter_ == MapFilter::bilinear ? 0.5 : 0.0;
  const double longitude = (0.5 - (column + shift + right) / width_) * 2 * kPiDouble;
  return {static_cast<float>(sin_polar * std::sin(longitude)), static_cast<float>(y),
          static_cast<float>(sin_polar * std::cos(longitude))};
}

}  // namespace baton
