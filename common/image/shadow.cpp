#include "common/image/shadow.h"

namespace baton {
namespace {

std::array<float*, 3> planes(FilmTile& film, const std::array<const char*, 3>& names) {
  return {film.find(names[0]), film.find(names[1]), film.find(names[2])};
}

}  // namespace

void finish_shadows(FilmTile& film) {
  const float* const share = film.find(kCatcherChannel);
  if (share == nullptr) return;
  for (float* const shadow : planes(film, kShadowChannels)) {
    for (std::size_t i = 0; i < film.num_pixels(); ++i)
      shadow[i] = share[i] > 0 ? shadow[i] / share[i] : 1;
  }
}

void lay_over_plate(FilmTile& film, const RgbImage& plate) {
  const std::array color = planes(film, {"R", "G", "B"});
  const std::array shadow = planes(film, kShadowChannels);
  float* const alpha = film.find("A");
  const float* const share = film.find(kCatcherChannel);
  std::size_t i = 0;
  for (int y = film.rect.y0; y < film.rect.y1; ++y) {
    for (int x = film.rect.x0; x < film.rect.x1; ++x, ++i) {
      if (x < 0 || x >= plate.width || y < 0 || y >= plate.height) continue;
      const float* const behind = &plate.rgb[(static_cast<std::size_t>(y) * plate.width + x) * 3];
      const float open = 1 - alpha[i] - (share != nullptr ? share[i] : 0);
      for (std::size_t c = 0; c < 3; ++c)
        color[c][i] += (open + (share != nullptr ? shadow[c][i] : 0)) * behind[c];
      alpha[i] = 1;
    }
  }
}

void put_shadows_in_alpha(FilmTile& film) {
  const float* const share = film.find(kCatcherChannel);
  if (share == nullptr) return;
  const std::array shadow = planes(film, kShadowChannels);
  float* const alpha = film.find("A");
  for (std::size_t i = 0; i < film.num_pixels(); ++i)
    alpha[i] += share[i] - luminance({shadow[0][i], shadow[1][i], shadow[2][i]});
}

}  // namespace baton
