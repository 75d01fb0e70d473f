#include "jobs/study/seed_noise.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "common/math/vec3.h"
#include "jobs/study/picture.h"

namespace baton {
namespace {

/// Pixels that see surfaces turned or distant by more see something else.
constexpr float kMaxTurn = 0.05f, kMaxDepthRatio = 0.01f;

/// The planes of a frame.
struct Planes {
  static constexpr std::array kNames{"R",     "G",        "B",        "A",
                                     "depth", "normal.X", "normal.Y", "normal.Z"};
  std::array<const float*, kNames.size()> plane;

  Vec3 color(std::size_t i) const { return {plane[0][i], plane[1][i], plane[2][i]}; }
  float coverage(std::size_t i) const { return plane[3][i]; }
  float depth(std::size_t i) const { return plane[4][i]; }
  Vec3 normal(std::size_t i) const { return {plane[5][i], plane[6][i], plane[7][i]}; }
};

Result<Planes> planes_of(const FilmTile& film) {
  Planes planes;
  for (std::size_t c = 0; c < planes.plane.size(); ++c) {
    planes.plane[c] = film.find(Planes::kNames[c]);
    if (planes.plane[c] == nullptr)
      return Error{ErrorKind::bad_input, fmt::format("expected a channel {}", Planes::kNames[c])};
  }
  return planes;
}

bool see_the_same(const Planes& a, const Planes& b, std::size_t i) {
  return a.coverage(i) >= 1 && b.coverage(i) >= 1 && length(a.normal(i) - b.normal(i)) < kMaxTurn &&
         std::abs(a.depth(i) - b.depth(i)) < kMaxDepthRatio * a.depth(i);
}

}  // namespace

Status SeedNoise::add(const FilmTile& first, const FilmTile& second) {
  BATON_ASSIGN(const Planes a, planes_of(first));
  BATON_ASSIGN(const Planes b, planes_of(second));
  if (first.rect != second.rect)
    return Error{ErrorKind::bad_input, "expected two frames of one size"};
  for (std::size_t i = 0; i < first.num_pixels(); ++i) {
    if (!see_the_same(a, b, i)) continue;
    const double x = mean(a.color(i)), y = mean(b.color(i));
    const double relative = (x - y) / ((x + y) / 2 + kRelativeFloor);
    squares += relative * relative / 2;
    pixels += 1;
  }
  return {};
}

double SeedNoise::deviation() const { return pixels > 0 ? std::sqrt(squares / pixels) : 0.0; }

}  // namespace baton
