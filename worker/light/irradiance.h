#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "worker/surface/environment.h"

namespace baton {

/// The integral of L max(0, n.w) over the sphere, per channel, for every normal n: what a surface
/// receives without shadows. It is a sum over a grid of points in angle, at least as fine as the
/// map's texels; small maps are summed between their texels, as they are reconstructed.
///
/// Points are joined to blocks of 8 x 8, these to blocks of 2 x 2, and so on. A block above the
/// horizon of n adds n.(sum of its light times direction), one below nothing, and one that is cut
/// is summed more finely, down to its points. Where all that is open of a block is less than
/// kOpenShare of the sum so far, its light is taken as spread evenly about its mean: see at().
class Irradiance {
 public:
  explicit Irradiance(const EnvironmentMap& map);

  /// normal: unit, in the world. environment: with a map of the texels that it was made of. A pure
  /// function of both.
  Rgb at(const Environment& environment, const Vec3& normal) const;
  std::size_t size_bytes() const;

 private:
  using Sum = std::array<double, 3>;
  /// The light of one channel.
  struct Light {
    float power = 0;  ///< sum of radiance times solid angle
    Vec3 sum;         ///< sum of radiance x angle x direction
  };
  struct Block {
    Vec3 axis;  ///< points are within `sine` of this axis
    /// Sine of the cone's half-angle; above 1: more than 90 degrees.
    float sine = 0;
    std::array<Light, 3> light;
    /// Covariance of the directions, by the mean of the channels: xx, xy, xz, yy, yz, zz.
    std::array<float, 6> spread{};

    float variance_along(const Vec3& n) const;
    void add_even(const Vec3& n, float half_width, Sum& sum) const;
  };
  /// Blocks of one size, row by row.
  struct Level {
    int width = 0, height = 0;
    int side = 0;  ///< points of a block in each direction
    std::vector<Block> blocks;
  };
  struct Row {
    float sine = 0, cosine = 0;  ///< sine and cosine of the polar angle
    float area = 0;              ///< solid angle of a point
  };
  struct Longitude {
    float sine = 0, cosine = 0;
  };
  struct Moments;

  void place_points(int columns, int rows);
  void reconstruct(const EnvironmentMap& map);
  Rgb radiance(const EnvironmentMap& map, int column, int row) const;
  std::vector<Moments> first_moments(const EnvironmentMap& map) const;
  Vec3 direction(int column, int row) const;
  Level make_level(const std::vector<Moments>& moments, int side) const;
  static std::vector<Moments> joined(const std::vector<Moments>& parts, int width, int height);
  void add_points(const EnvironmentMap& map, int x, int y, const Vec3& n, Sum& sum) const;

  std::vector<Row> rows_;
  std::vector<Longitude> longitudes_;
  /// (rows, columns) radiance; empty: that of the texels.
  std::vector<Rgb> points_;
  std::vector<Level> levels_;  ///< from the smallest blocks on
};

}  // namespace baton
