#include "worker/surface/environment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <span>

#include "common/base/check.h"
#include "common/math/octahedral.h"
#include "common/scene/map/map_reduction.h"
#include "common/scene/map/map_texel.h"

namespace baton {
namespace {

/// Cells between two kept cumulative sums of a row.
constexpr int kBlock = 16;

/// Density of texels so dim that float cannot hold theirs.
constexpr float kMinDensity = std::numeric_limits<float>::min();

/// Compensation that leaves less than this share of the power is noise: the map is constant.
constexpr double kMinCompensatedShare = 1e-5;

double mean_rgb(const EnvironmentMap::Texel& t) {
  return (static_cast<double>(t.r) + t.g + t.b) * (1.0 / 3.0);
}

/// Does f(row) for rows of a table, in bands.
template <class F>
void for_each_row(const DoParts& do_parts, std::size_t rows, const F& f) {
  constexpr std::size_t kBand = 32;
  do_parts((rows + kBand - 1) / kBand, [&](std::size_t band) {
    for (std::size_t row = band * kBand; row < std::min(rows, (band + 1) * kBand); ++row) f(row);
  });
}

int num_blocks(int width) { return (width + kBlock - 1) / kBlock; }

}  // namespace

EnvironmentMap::EnvironmentMap(const RgbImage& image, MapFilter filter, float scale,
                               bool compensate, const HiddenCone& hidden, float capped_share,
                               const DoParts& do_parts)
    : width_(image.width), height_(image.height), filter_(filter) {
  BATON_CHECK(width_ > 0 && height_ > 0);
  BATON_CHECK(image.rgb.size() == std::size_t{3} * static_cast<std::size_t>(width_) * height_);
  texels_.resize(static_cast<std::size_t>(stride()) * (height_ + 2));

  // Copy the rows, zero what is no radiance.
  for_each_row(do_parts, static_cast<std::size_t>(height_), [&](std::size_t j) {
    const float* source = image.rgb.data() + 3 * j * static_cast<std::size_t>(width_);
    Texel* row = &texels_[(j + 1) * static_cast<std::size_t>(stride()) + 1];
    for (int i = 0; i < width_; ++i, source += 3) {
      const auto [r, g, b] = texel_radiance(source, scale);
      row[i] = {r, g, b, 0};
    }

    // Wrap around horizontally.
    row[-1] = row[width_ - 1];
    row[width_] = row[0];
  });

  // Repeat the first and the last row.
  std::copy_n(texels_.begin() + stride(), stride(), texels_.begin());
  std::copy_n(texels_.end() - 2 * stride(), stride(), texels_.end() - stride());
  if (hidden.angle > 0) hide(hidden);
  build_table(compensate, capped_share, do_parts);
}

EnvironmentMap::EnvironmentMap(const EnvironmentMap& a, const EnvironmentMap& b, float t,
                               float scale, bool compensate, float capped_share,
                               const DoParts& do_parts)
    : width_(a.width_), height_(a.height_), filter_(a.filter_) {
  BATON_CHECK(a.width_ == b.width_ && a.height_ == b.height_ && a.filter_ == b.filter_);
  texels_.resize(a.texels_.size());
  const auto columns = static_cast<std::size_t>(stride());
  for_each_row(do_parts, texels_.size() / columns, [&](std::size_t row) {
    for (std::size_t i = row * columns; i < (row + 1) * columns; ++i) {
      const Texel& p = a.texels_[i];
      const Texel& q = b.texels_[i];
      texels_[i] = {scale * ((1 - t) * p.r + t * q.r), scale * ((1 - t) * p.g + t * q.g),
                    scale * ((1 - t) * p.b + t * q.b), std::copysign(0.0f, p.density)};
    }
  });
  build_table(compensate, capped_share, do_parts);
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
    texel[-1].density = texel[width_ - 1].density;
    texel[width_].density = texel[0].density;
  }
}

EnvironmentMap::Edges EnvironmentMap::edges_of(const Texel* texel) const {
  if (texel->is_hidden()) return {};
  const auto weight = [](const Texel& t) { return std::fabs(double{t.density}); };
  if (filter_ == MapFilter::nearest) return {weight(*texel), weight(*texel)};
  const Texel* below = texel + stride();
  return {0.5 * (weight(texel[0]) + weight(texel[1])), 0.5 * (weight(below[0]) + weight(below[1]))};
}

double EnvironmentMap::weight_down(const Texel* texel, double place) const {
  const auto weight = [](const Texel& t) { return std::fabs(double{t.density}); };
  if (filter_ == MapFilter::nearest) return weight(*texel);
  return (1 - place) * weight(*texel) + place * weight(texel[stride()]);
}

double EnvironmentMap::weigh_texels(const DoParts& do_parts) {
  for_each_texel(do_parts, [](Texel& texel, std::size_t) {
    texel.density = std::copysign(static_cast<float>(mean_rgb(texel)), texel.density);
  });
  return integral_of_weights(do_parts);
}

void EnvironmentMap::reduce_weights(double offset, double factor, const DoParts& do_parts) {
  for_each_texel(do_parts, [&](Texel& texel, std::size_t) {
    const double weight = std::fabs(double{texel.density}) - offset;
    const float density =
        weight > 0 ? std::max(static_cast<float>(weight * factor), kMinDensity) : 0.0f;
    texel.density = std::copysign(density, texel.density);
  });
}

double EnvironmentMap::integral_of_weights(const DoParts& do_parts) const {
  std::vector<double> of_rows(static_cast<std::size_t>(cell_rows()));
  for_each_row(do_parts, of_rows.size(), [&](std::size_t r) {
    const Texel* texel = &texels_[cell_row(static_cast<int>(r))];
    Edges row;
    for (int i = 0; i < width_; ++i) row += edges_of(texel + i);
    of_rows[r] = rows_[r].integral(row.upper, row.lower);
  });
  return std::accumulate(of_rows.begin(), of_rows.end(), 0.0);
}

void EnvironmentMap::cap_weights(float share, double power, const DoParts& do_parts) {
  std::vector<float> plain(texels_.size());
  const auto most = static_cast<float>(power / (4 * std::numbers::pi));
  for_each_texel(do_parts, [&](Texel& texel, std::size_t i) {
    plain[i] = std::fabs(texel.density);
    texel.density = std::copysign(std::min(plain[i], most), texel.density);
  });
  const double capped_power = integral_of_weights(do_parts);
  if (!(capped_power > 0)) share = 0;
  const double factor = share > 0 ? share / capped_power * power : 0;
  for_each_texel(do_parts, [&](Texel& texel, std::size_t i) {
    const double weight = (1 - double{share}) * plain[i] + factor * std::fabs(texel.density);
    texel.density = std::copysign(static_cast<float>(weight), texel.density);
  });
}

template <class F>
void EnvironmentMap::for_each_texel(const DoParts& do_parts, const F& f) {
  const auto columns = static_cast<std::size_t>(stride());
  for_each_row(do_parts, texels_.size() / columns, [&](std::size_t row) {
    for (std::size_t i = row * columns; i < (row + 1) * columns; ++i) f(texels_[i], i);
  });
}

void EnvironmentMap::build_table(bool compensate, float capped_share, const DoParts& do_parts) {
  const int rows = cell_rows(), blocks = num_blocks(width_);
  for (int r = 0; r < rows; ++r) rows_.emplace_back(row_angle(r), row_angle(r + 1), width_);

  // Turn radiance into densities.
  double power = total_power_ = weigh_texels(do_parts);
  if (compensate) {
    reduce_weights(total_power_ / (4 * std::numbers::pi), 1, do_parts);
    power = integral_of_weights(do_parts);
    if (power < kMinCompensatedShare * total_power_) power = weigh_texels(do_parts);
  }
  if (capped_share > 0 && power > 0) {
    cap_weights(capped_share, power, do_parts);
    power = integral_of_weights(do_parts);
  }
  reduce_weights(0, power > 0 ? 1 / power : 0, do_parts);

  // Sum them up.
  const auto row_size = static_cast<std::size_t>(blocks + 1);
  block_cdf_.resize(static_cast<std::size_t>(rows) * row_size);
  for_each_row(do_parts, static_cast<std::size_t>(rows), [&](std::size_t r) {
    const Texel* texel = &texels_[cell_row(static_cast<int>(r))];
    Edges* const sums = &block_cdf_[r * row_size];
    for (int block = 0; block < blocks; ++block) {
      Edges sum = sums[block];
      const int end = std::min((block + 1) * kBlock, width_);
      for (int i = block * kBlock; i < end; ++i) sum += edges_of(texel + i);
      sums[block + 1] = sum;
    }
  });
  row_cdf_.assign(1, 0.0);
  for (std::size_t r = 0; r < static_cast<std::size_t>(rows); ++r) {
    const Edges& sum = block_cdf_[(r + 1) * row_size - 1];
    row_cdf_.push_back(row_cdf_.back() + rows_[r].integral(sum.upper, sum.lower));
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
    Texel found = *texel(i, std::min(static_cast<int>(y), height_ - 1));
    if (found.is_hidden()) found.density = -0.0f;
    return found;
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
  const float density = a->is_hidden() ? -0.0f
                                       : blend(std::fabs(a[0].density), std::fabs(a[1].density),
                                               std::fabs(b[0].density), std::fabs(b[1].density));
  return {blend(a[0].r, a[1].r, b[0].r, b[1].r), blend(a[0].g, a[1].g, b[0].g, b[1].g),
          blend(a[0].b, a[1].b, b[0].b, b[1].b), density};
}

Vec3 EnvironmentMap::sample(const std::array<float, 2>& u) const {
  BATON_CHECK(row_cdf_.back() > 0);

  // Choose the row, and the place in it; then, along that parallel, the block of cells.
  const double z = u[0] * row_cdf_.back();
  const auto row_end = std::upper_bound(row_cdf_.begin(), row_cdf_.end(), z);
  const auto r = static_cast<std::size_t>(row_end - row_cdf_.begin()) - 1;
  const auto blocks = static_cast<std::size_t>(num_blocks(width_));
  const std::span block_cdf = std::span(block_cdf_).subspan(r * (blocks + 1), blocks + 1);
  const MapRow& row = rows_[r];
  const double down = std::clamp(row.place(block_cdf.back().upper, block_cdf.back().lower,
                                           (z - row_cdf_[r]) / (row_cdf_[r + 1] - row_cdf_[r])),
                                 row.margin_down(), 1 - row.margin_down());
  const double x = u[1] * block_cdf.back().at(down);
  const auto block_end =
      std::partition_point(block_cdf.begin(), block_cdf.end() - 1,
                           [&](const Edges& below) { return below.at(down) <= x; });
  const std::ptrdiff_t block = block_end - block_cdf.begin() - 1;

  // Choose the cell, and the place in it. The margins keep it there when it is rounded to float or
  // to the lattice of carried directions: with `nearest` light that slips from a bright cell into a
  // dim one would be divided by too small a density, and what slips the other way does not make up
  // for it; and what is hidden has none.
  const Texel* texels = &texels_[cell_row(static_cast<int>(r))];
  const bool is_nearest = filter_ == MapFilter::nearest;
  const auto side = [&](int i) { return weight_down(texels + i, down); };
  const int first = static_cast<int>(block) * kBlock, end = std::min(first + kBlock, width_);
  double below = block_cdf[static_cast<std::size_t>(block)].at(down), rest = 0, chosen = 1;
  double left = side(first), left_of_chosen = 0, right_of_chosen = 0;
  int column = first;
  for (int i = first; i < end && below <= x; ++i) {
    if (is_nearest) left = side(i);
    const double right = is_nearest ? left : side(i + 1);
    if (const double cell = texels[i].is_hidden() ? 0 : 0.5 * (left + right); cell > 0) {
      column = i;
      rest = x - below;
      chosen = cell;
      left_of_chosen = left;
      right_of_chosen = right;
      below += cell;
    }
    left = right;
  }
  const double right = std::clamp(
      place_in_linear(left_of_chosen, right_of_chosen, std::clamp(rest / chosen, 0.0, 1.0)),
      row.margin_across(), 1 - row.margin_across());

  // Where that is on the sphere.
  const double polar = row.angle(down), sin_polar = std::sin(polar);
  const double shift = is_nearest ? 0.0 : 0.5;
  const double longitude = (0.5 - (column + shift + right) / width_) * 2 * std::numbers::pi;
  return {static_cast<float>(sin_polar * std::sin(longitude)), static_cast<float>(std::cos(polar)),
          static_cast<float>(sin_polar * std::cos(longitude))};
}

EnvironmentMap make_map(const RgbImage& picture, const EnvironmentSpec& environment,
                        bool compensate, const HiddenCone& hidden, float capped_share,
                        const DoParts& do_parts) {
  const int width = map_sides(picture.width, picture.height, environment.max_width)[0];
  if (width == picture.width)
    return {picture, environment.filter, environment.scale, compensate,
            hidden,  capped_share,       do_parts};
  return {reduce_map(picture, width, environment.scale),
          environment.filter,
          1,
          compensate,
          hidden,
          capped_share,
          do_parts};
}

}  // namespace baton
