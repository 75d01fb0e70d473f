#pragma once

#include "common/image/film_tile.h"

namespace baton {

/// How two seeds of one frame differ, over the pixels of which both see the same surface: the sites
/// of a pixel lie elsewhere with another seed, and what that changes is no noise of a method.
struct SeedNoise {
  double squares = 0;  ///< sum of squared relative differences over 2: the variance of one seed
  double pixels = 0;

  /// Both frames have the channels R, G, B, A, depth and normal.X, .Y, .Z. Error: one has not, or
  /// their sizes differ.
  Status add(const FilmTile& a, const FilmTile& b);
  /// Relative standard deviation of a pixel's grey value, rms over pixels; 0 without any.
  double deviation() const;
};

}  // namespace baton
