#include "common/image/noise.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/image/as_shown.h"

namespace baton {
void FrameNoise::add_pixel(double grey) {
  if (!std::isfinite(grey)) return;
  light_ += grey;
  ++num_pixels_;
}

void FrameNoise::add_error(double square) {
  if (!std::isfinite(square)) return;
  squares_ += square;
  squares_of_squares_ += square * square;
  ++num_errors_;
}

float FrameNoise::relative() const {
  if (!is_told()) return 0;
  const double error = std::sqrt(squares_ / static_cast<double>(num_errors_));
  return static_cast<float>(error * static_cast<double>(num_pixels_) / light_);
}

float FrameNoise::error_share() const {
  if (!is_told() || !(squares_ > 0)) return 0;
  // The relative error of a mean, by the scatter of its values; a root has half of it.
  const double n = static_cast<double>(num_errors_);
  if (n < 2) return 1;
  const double scatter = std::max(0.0, n * squares_of_squares_ / (squares_ * squares_) - 1);
  return static_cast<float>(std::sqrt(scatter / (n - 1)) / 2);
}

double cycles_noise_squared(double variance, double grey) {
  constexpr double kDark = 1e-4;
  return 6 / std::numbers::pi * variance / std::max(grey, kDark);
}

float cycles_noise(const FilmTile& film) {
  constexpr double kExceeded = 0.01;
  const FilmColors colors(film);
  const float* const error = film.find(kErrorChannel);
  if (!colors || error == nullptr) return 0;
  struct Square {
    double sum = 0;
    std::size_t count = 0;
    double mean() const { return sum / static_cast<double>(count); }
  };
  const NoiseBlocks blocks(film.rect);
  std::vector<Square> squares(blocks.count());
  Square all;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    const double grey = colors.grey(i);
    if (error[i] == kErrorUnknown) return 0;
    if (!(error[i] >= 0) || !std::isfinite(error[i]) || !std::isfinite(grey)) continue;
    for (Square* const square : {&all, &squares[blocks.of(i)]}) {
      square->sum += cycles_noise_squared(double{error[i]}, grey);
      ++square->count;
    }
  }
  if (all.count == 0) return 0;

  // The square that at most 1 % exceed.
  std::vector<double> means;
  for (const Square& square : squares)
    if (square.count >= kFewestInNoiseBlock) means.push_back(square.mean());
  if (means.empty()) return static_cast<float>(std::sqrt(all.mean()));
  const auto above = static_cast<std::size_t>(kExceeded * static_cast<double>(means.size()));
  const auto at = means.begin() + static_cast<std::ptrdiff_t>(means.size() - 1 - above);
  std::nth_element(means.begin(), at, means.end());
  return static_cast<float>(std::sqrt(*at));
}

float noise_as_shown(const FilmTile& film) {
  const FilmColors colors(film);
  const float* const error = film.find(kErrorChannel);
  if (!colors || error == nullptr) return 0;
  std::vector<float> greys;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    const auto grey = static_cast<float>(colors.grey(i));
    if (error[i] != kNoSurface && std::isfinite(grey)) greys.push_back(grey);
  }
  const double exposure = exposure_as_shown(greys);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    const double grey = colors.grey(i);
    if (!(error[i] >= 0) || !std::isfinite(error[i]) || !std::isfinite(grey)) continue;
    const double sigma = std::sqrt(double{error[i]});
    const auto shown = [&](double value) {
      return double{encode_srgb(static_cast<float>(exposure * value))};
    };
    const double half = (shown(grey + sigma) - shown(grey - sigma)) / 2;
    sum += half * half;
    ++count;
  }
  return count == 0 ? 0 : static_cast<float>(std::sqrt(sum / static_cast<double>(count)));
}

FrameNoise noise_of_film(const FilmTile& film) {
  FrameNoise noise;
  const FilmColors colors(film);
  const float* const error = film.find(kErrorChannel);
  if (!colors || error == nullptr) return noise;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    if (error[i] == kNoSurface) continue;
    noise.add_pixel(colors.grey(i));
    if (error[i] != kErrorUnknown) noise.add_error(double{error[i]});
  }
  return noise;
}

FrameNoise noise_of_seeds(const FilmTile& a, const FilmTile& b) {
  FrameNoise noise;
  const FilmColors first(a), second(b);
  const float* const alpha = a.find("A");
  if (!first || !second || alpha == nullptr || a.rect != b.rect) return noise;
  for (std::size_t i = 0; i < a.num_pixels(); ++i) {
    if (!(alpha[i] > 0)) continue;
    const double x = first.grey(i), y = second.grey(i);
    noise.add_pixel((x + y) / 2);
    noise.add_error(squared_error(x, y));
  }
  return noise;
}

}  // namespace baton
