#include "worker/scene/environment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/base/check.h"
#include "common/math/octahedral.h"

namespace baton {
namespace {

/// Cells between two kept cumulative sums of a row.
constexpr int kBlock = 16;

/// Density of cells so dim that float cannot hold theirs.
constexpr float kMinDensity = std::numeric_limits<float>::min();

/// Compensation that leaves less than this share of the power is noise: the map is constant.
constexpr double kMinCompensatedShare = 1e-5;

double mean_rgb(const EnvironmentMap::Texel& t) {
  return (static_cast<double>(t.r) + t.g + t.b) * (1.0 / 3.0);
}

/// Solid angle between two polar angles, cos a - cos b without cancellation, times 2 pi.
double zone_solid_angle(double a, double b) {
  return 4 * std::numbers::pi * std::sin(0.5 * (a + b)) * std::sin(0.5 * (b - a));
}

int num_blocks(int width) { return (width + kBlock - 1) / kBlock; }

}  // namespace

EnvironmentMap::EnvironmentMap(const RgbImage& image, MapFilter filter, float scale,
                               bool compensate, const TexelRepairs& repairs,
                               const HiddenCone& hidden)
    : width_(image.width), height_(image.height), filter_(filter), repairs_(repairs) {
  BATON_CHECK(width_ > 0 && height_ > 0);
  BATON_CHECK(image.rgb.size() == std::size_t{3} * static_cast<std::size_t>(width_) * height_);
  texels_.resize(static_cast<std::size_t>(stride()) * (height_ + 2));

  // Copy the rows, zero what is no radiance.
  const float* source = image.rgb.data();
  for (int j = 0; j < height_; ++j) {
    Texel* row = &texels_[static_cast<std::size_t>(j + 1) * stride() + 1];
    for (int i = 0; i < width_; ++i, source += 3) {
      const auto [r, g, b] = texel_radiance(source, scale, repairs_);
      row[i] = {r, g, b, 0};
    }

    // Wrap around horizontally.
    row[-1] = row[width_ - 1];
    row[width_] = row[0];
  }

  // Repeat the first and the last row.
  std::copy_n(texels_.begin() + stride(), stride(), texels_.begin());
  std::copy_n(texels_.end() - 2 * stride(), stride(), texels_.end() - stride());
  if (hidden.angle > 0) hide(hidden);
  build_table(compensate);
}

EnvironmentMap::EnvironmentMap(const EnvironmentMap& a, const EnvironmentMap& b, float t,
                               float scale, bool compensate)
    : width_(a.width_), height_(a.height_), filter_(a.filter_) {
  BATON_CHECK(a.width_ == b.width_ && a.height_ == b.height_ && a.filter_ == b.filter_);
  texels_.resize(a.texels_.size());
  for (std::size_t i = 0; i < texels_.size(); ++i) {
    const Texel& p = a.texels_[i];
    const Texel& q = b.texels_[i];
    texels_[i] = {scale * ((1 - t) * p.r + t * q.r), scale * ((1 - t) * p.g + t * q.g),
                  scale * ((1 - t) * p.b + t * q.b), std::copysign(0.0f, p.density)};
  }
  build_table(compensate);
}

int EnvironmentMap::cell_rows() const { return height_ + (filter_ == MapFilter::bilinear ? 1 : 0); }

double EnvironmentMap::row_angle(int row) const {
  const double shift = filter_ == MapFilter::bilinear ? 0.5 : 0.0;
  return std::clamp((row - shift) / height_, 0.0, 1.0) * std::numbers::pi;
}

std::size_t EnvironmentMap::cell_row(int row) const {
  const int padded_row = filter_ == MapFilter::bilinear ? row : row + 1;
  return static_cast<std::size_t>(padded_row) * stride() + 1;
}

void EnvironmentMap::hide(const HiddenCone& cone) {
  // The middle of a cell, in texels: of a texel, or of the four corners of a dual cell.
  const double shift_x = filter_ == MapFilter::bilinear ? 1.0 : 0.5;
  const double shift_y = filter_ == MapFilter::bilinear ? 0.0 : 0.5;
  const double row_step = std::numbers::pi / height_, column_step = 2 * std::numbers::pi / width_;
  // No point of a cell is farther from its middle than half its height and half its width.
  const double reach = cone.angle - 0.5 * (row_step + column_step);
  if (reach <= 0) return;
  const double least = std::cos(reach);

  std::vector<double> around(static_cast<std::size_t>(width_));
  for (std::size_t i = 0; i < around.size(); ++i) {
    const double longitude = std::numbers::pi - (static_cast<double>(i) + shift_x) * column_step;
    around[i] = std::sin(longitude) * cone.axis[0] + std::cos(longitude) * cone.axis[2];
  }
  for (int r = 0; r < cell_rows(); ++r) {
    const double polar = (r + shift_y) * row_step;
    Texel* texel = &texels_[cell_row(r)];
    for (std::size_t i = 0; i < around.size(); ++i) {
      if (std::sin(polar) * around[i] + std::cos(polar) * cone.axis[1] >= least)
        texel[i].density = -0.0f;
    }
  }
}

std::vector<double> EnvironmentMap::row_means(int row) const {
  const Texel* texel = &texels_[cell_row(row)];
  std::vector<double> means(static_cast<std::size_t>(width_) + 1);
  for (int i = 0; i <= width_; ++i) means[static_cast<std::size_t>(i)] = mean_rgb(texel[i]);
  return means;
}

double EnvironmentMap::measure_row(int row, const std::vector<double>& means,
                                   const std::vector<double>& means_below) {
  // A nearest cell is one texel; a bilinear cell has corners in two columns of two rows. What is
  // hidden counts as black.
  Texel* texel = &texels_[cell_row(row)];
  double sum = 0;
  const bool nearest = filter_ == MapFilter::nearest;
  for (std::size_t i = 0; i < static_cast<std::size_t>(width_); ++i) {
    const double mean =
        nearest ? means[i]
                : 0.25 * ((means[i] + means_below[i]) + (means[i + 1] + means_below[i + 1]));
    if (!texel[i].is_hidden()) texel[i].density = static_cast<float>(mean);
    sum += texel[i].density;
  }
  return sum;
}

std::pair<double, double> EnvironmentMap::compensation(
    const std::vector<double>& solid_angle) const {
  const double offset = total_power_ / (4 * std::numbers::pi);
  double power = 0;
  for (int r = 0; r < cell_rows(); ++r) {
    const Texel* texel = &texels_[cell_row(r)];
    double sum = 0;
    for (int i = 0; i < width_; ++i) sum += std::max(0.0, texel[i].density - offset);
    power += sum * solid_angle[r];
  }
  if (power < kMinCompensatedShare * total_power_) return {0.0, total_power_};
  return {offset, power};
}

void EnvironmentMap::build_table(bool compensate) {
  // Measure the cells and the map's power.
  const int rows = cell_rows();
  std::vector<double> solid_angle(static_cast<std::size_t>(rows));
  std::vector<double> means = row_means(0);
  for (int r = 0; r < rows; ++r) {
    solid_angle[r] = zone_solid_angle(row_angle(r), row_angle(r + 1)) / width_;
    const bool ends = filter_ == MapFilter::nearest && r + 1 == rows;
    std::vector<double> below = ends ? std::vector<double>() : row_means(r + 1);
    total_power_ += measure_row(r, means, below) * solid_angle[r];
    means = std::move(below);
  }
  const auto [offset, power] =
      compensate ? compensation(solid_angle) : std::pair(0.0, total_power_);
  const double inverse_power = power > 0 ? 1 / power : 0.0;

  // Turn radiance into densities and cumulative sums; a cell with any weight keeps a positive
  // density.
  const int blocks = num_blocks(width_);
  row_cdf_.assign(static_cast<std::size_t>(rows) + 1, 0.0);
  block_cdf_.assign(static_cast<std::size_t>(rows) * (blocks + 1), 0.0);
  for (int r = 0; r < rows; ++r) {
    const double top = row_angle(r), bottom = row_angle(r + 1);
    const double sin_row = std::sin(0.5 * (top + bottom));
    rows_.push_back(
        {.top = std::cos(top),
         .drop = zone_solid_angle(top, bottom) / (2 * std::numbers::pi),
         .margin_right = std::min(
             0.5, kOctahedralError * width_ / (2 * std::numbers::pi * std::max(sin_row, 1e-9)))});
    Texel* texel = &texels_[cell_row(r)];
    double* block_cdf = &block_cdf_[static_cast<std::size_t>(r) * (blocks + 1)];
    for (int block = 0; block < blocks; ++block) {
      double sum = block_cdf[block];
      const int end = std::min((block + 1) * kBlock, width_);
      for (int i = block * kBlock; i < end; ++i) {
        const double weight = texel[i].density - offset;
        const auto density = static_cast<float>(weight * inverse_power);
        texel[i].density =
            weight > 0 ? std::max(density, kMinDensity) : std::copysign(0.0f, texel[i].density);
        sum += texel[i].density;
      }
      block_cdf[block + 1] = sum;
    }
    texel[-1].density = texel[width_ - 1].density;
    texel[width_].density = texel[0].density;
    row_cdf_[r + 1] = row_cdf_[r] + block_cdf[blocks] * solid_angle[r];
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

  // Choose the row, then the block of cells, then the cell.
  const auto row_end = std::upper_bound(row_cdf_.begin(), row_cdf_.end(), u[0] * row_cdf_.back());
  const int row = static_cast<int>(row_end - row_cdf_.begin()) - 1;
  const int blocks = num_blocks(width_);
  const double* block_cdf = &block_cdf_[static_cast<std::size_t>(row) * (blocks + 1)];
  const double x = u[1] * block_cdf[blocks];
  const int block =
      static_cast<int>(std::upper_bound(block_cdf, block_cdf + blocks + 1, x) - block_cdf) - 1;
  const Texel* texel = &texels_[cell_row(row)];
  int column = block * kBlock;
  double below = block_cdf[block];
  while (below + texel[column].density <= x) below += texel[column++].density;

  // The remainders place it in the cell. The margins keep it there when it is rounded to float or
  // to the lattice of carried directions: light that slips from a bright cell into a dim one would
  // be divided by too small a density, and what slips the other way does not make up for it.
  const auto& [top, drop, margin_right] = rows_[static_cast<std::size_t>(row)];
  const double margin_down = std::min(0.5, kOctahedralError * height_ / std::numbers::pi);
  const double down =
      std::clamp((u[0] * row_cdf_.back() - row_cdf_[row]) / (row_cdf_[row + 1] - row_cdf_[row]),
                 margin_down, 1 - margin_down);
  const double right =
      std::clamp((x - below) / texel[column].density, margin_right, 1 - margin_right);

  // Place the direction uniformly in the cell's solid angle.
  const double y = top - drop * down;
  const double sin_polar = std::sqrt(std::max(0.0, (1 - y) * (1 + y)));
  const double shift = filter_ == MapFilter::bilinear ? 0.5 : 0.0;
  const double longitude = (0.5 - (column + shift + right) / width_) * 2 * std::numbers::pi;
  return {static_cast<float>(sin_polar * std::sin(longitude)), static_cast<float>(y),
          static_cast<float>(sin_polar * std::cos(longitude))};
}

}  // namespace baton
