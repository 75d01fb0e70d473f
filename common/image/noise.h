#pragma once

#include <array>
#include <cstddef>

#include "common/image/film_tile.h"
#include "common/math/pixel_blocks.h"

namespace baton {

/// The squares of the picture that errors are judged by, so that a noisy corner counts; and the
/// number of counted pixels from which on one is judged.
using NoiseBlocks = PixelBlocksOf<16>;
inline constexpr std::size_t kFewestInNoiseBlock = 64;

/// The colours of a film; false: it has not all of them.
struct FilmColors {
  std::array<const float*, 3> plane;

  explicit FilmColors(const FilmTile& film)
      : plane{film.find("R"), film.find("G"), film.find("B")} {}
  explicit operator bool() const { return plane[0] && plane[1] && plane[2]; }
  double grey(std::size_t i) const {
    return (double{plane[0][i]} + double{plane[1][i]} + double{plane[2][i]}) / 3;
  }
};

/// The noise of a frame, the one measure of it in the program:
///
///   sqrt(mean over probes of sigma^2) / (mean over surfaces of grey)
///
/// grey: mean of R, G and B of a pixel; sigma^2: an estimate of its squared error; surfaces: all
/// pixels that see one; probes: those of them whose error is known. Of frames of several rounds or
/// sweeps that is all of them, by the scatter of these, sites included; of a single round one in
/// 128, sampled twice at the same sites.
/// Methods rank by it as by their RMSE, as all of them have the same mean.
class FrameNoise {
 public:
  /// A pixel that sees a surface. Values that are not finite are left out.
  void add_pixel(double grey);
  /// An estimate of the squared error of such a pixel.
  void add_error(double square);

  /// Whether there are errors and light to tell it from.
  bool is_told() const { return num_errors_ > 0 && light_ > 0; }
  /// 0 where it is not told.
  float relative() const;
  /// Its own standard error, as a share of it; large where a few pixels make most of the noise.
  float error_share() const;

 private:
  double squares_ = 0, squares_of_squares_ = 0, light_ = 0;
  std::size_t num_errors_ = 0, num_pixels_ = 0;
};

/// Half the squared difference of two independent estimates of one value: without bias, the squared
/// error of each.
inline double squared_error(double a, double b) { return (a - b) * (a - b) / 2; }

/// The plane of films that tells the squared error of pixels; frames do not have it.
inline constexpr char kErrorChannel[] = "error";
/// In that plane: a pixel that sees no surface, and one whose error is not known.
inline constexpr float kNoSurface = -2, kErrorUnknown = -1;

/// The error of a pixel as Cycles measures it for its noise threshold, so that its numbers carry
/// over: sum over R, G, B of |a - b| / sqrt(R + G + B), where a is a pixel and b half of its
/// samples. Of errors that are alike and normal in the three colours its square has this mean, 6/pi
/// variance / grey. Dark pixels count as much as a grey of 1e-4.
double cycles_noise_squared(double variance, double grey);

/// What quality.noiseThreshold is held against: the rms of that measure over the pixels of each
/// square of NoiseBlocks that has kFewestInNoiseBlock surfaces, and of these squares the one that
/// at most 1 % exceed. Where no square has as many, all pixels are one. 0: not
/// told, as of a film of a single round, whose probes are too few to say it of a corner.
float cycles_noise(const FilmTile& film);

/// The noise of a film as people see it: the rms over its probes of half the distance of
/// grey + sigma and grey - sigma, both as shown (common/image/as_shown.h) at the exposure of the
/// surfaces' grey. In [0, .5]; 0: not told.
float noise_as_shown(const FilmTile& film);

/// Noise of a film with an error plane and R, G, B; not told without them. Sums are taken in the
/// order of the pixels.
FrameNoise noise_of_film(const FilmTile& film);

/// Noise of two frames with the channels R, G, B, A of one size, by two seeds; pixels that see a
/// surface are those with alpha. Not told without the channels.
FrameNoise noise_of_seeds(const FilmTile& a, const FilmTile& b);

}  // namespace baton
