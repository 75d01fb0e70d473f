#pragma once

#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "common/base/team.h"
#include "common/image/image_io.h"
#include "common/job/plan/sequence.h"
#include "worker/surface/map_row.h"

namespace baton {

/// Directions of a map whose light reaches no surface of a job: those within an angle of an axis.
struct HiddenCone {
  std::array<float, 3> axis{0, -1, 0};  ///< unit, in the map's own frame
  float angle = 0;                      ///< radians, [0, pi / 2); 0: there are none

  auto operator<=>(const HiddenCone&) const = default;
};

/// A lat-long radiance map with its sampling table, in the map's own frame (no rotation).
///
/// Mapping (OpenEXR's LATLONG): +Y up, the centre of the picture looks along +Z, u = 1/2 - atan2(x,
/// z) / (2 pi) to the right, v = angle from +Y / pi downwards; texel (i, j) covers [i, i+1)/W x [j,
/// j+1)/H.
///
/// The table's cells: with `nearest` the texels, with `bilinear` the cells of the dual grid between
/// four texel centres (W x (H+1), the first and last row half as high). Every texel has a weight,
/// the mean over RGB of its radiance (less what MIS compensation takes off), and the density is the
/// same reconstruction of these weights over their integral: without compensation it is the mean
/// radiance along the direction over the map's power, exactly. A share of it may go by the radiance
/// capped at the map's mean instead: where nearly all of the power is in a lamp, who does not see
/// that has directions left. Cells that lie in a HiddenCone are
/// seen, and light nothing: no density.
///
/// Texels are stored once, padded by one texel on every side, as {R, G, B, density}: texel (i, j)
/// at [(j + 1) * stride + (i + 1)], i in [-1, W], j in [-1, H]. `density` is the table's pdf in
/// 1/sr at the texel's centre, so that one look-up gives radiance and pdf; its sign says whether
/// the cell whose upper left corner (nearest: which itself) is the texel is hidden.
class EnvironmentMap {
 public:
  struct Texel {
    float r = 0, g = 0, b = 0, density = 0;

    /// Reaches no surface; stored: the texel's cell.
    bool is_hidden() const { return std::signbit(density); }
  };

  /// image: at least 1x1. scale: radiance factor. compensate: the table of MIS compensation, max(0,
  /// L - mean L) [Karlik et al. 2019] (a constant map keeps its plain table). capped_share: of the
  /// density, by capped radiance; [0, 1), not with `compensate`. do_parts: bands of rows, which do
  /// not show.
  EnvironmentMap(const RgbImage& image, MapFilter filter, float scale, bool compensate,
                 const HiddenCone& hidden = {}, float capped_share = 0,
                 const DoParts& do_parts = do_in_turn);
  /// Texels scale ((1 - t) a + t b); a and b of one size and filter, with one cone. t in [0, 1].
  EnvironmentMap(const EnvironmentMap& a, const EnvironmentMap& b, float t, float scale,
                 bool compensate, float capped_share = 0, const DoParts& do_parts = do_in_turn);

  int width() const { return width_; }
  int height() const { return height_; }
  int stride() const { return width_ + 2; }
  MapFilter filter() const { return filter_; }
  const Texel* texels() const { return texels_.data(); }
  /// Memory of the texels; the tables are small beside them.
  std::size_t size_bytes() const { return texels_.size() * sizeof(Texel); }
  /// Integral of the reconstruction over what is not hidden, as the table sees it, mean over RGB; 0
  /// for a black map.
  double total_power() const { return total_power_; }
  bool black() const { return !(total_power_ > 0); }
  /// Radiance and density along unit `w` (map frame).
  Texel evaluate(const Vec3& w) const;
  /// A direction with density evaluate(w).density. u: 2 uniforms in [0, 1). Monotone in u, so well
  /// spread points stay well spread. Must not be called on a black map.
  Vec3 sample(const std::array<float, 2>& u) const;

 private:
  /// What a row of cells holds: for its upper and its lower edge, the sum over its visible cells of
  /// the mean along the cell's edge.
  struct Edges {
    double upper = 0, lower = 0;
    /// At a place from the upper edge (0) to the lower one (1).
    double at(double place) const { return (1 - place) * upper + place * lower; }
    Edges& operator+=(const Edges& other) {
      upper += other.upper;
      lower += other.lower;
      return *this;
    }
  };

  int cell_rows() const;
  /// Polar angle of the upper edge of a cell row; `cell_rows()` gives the lower edge of the last.
  double row_angle(int row) const;
  /// Index in texels_ of the texel that owns the first cell of a row.
  std::size_t cell_row(int row) const;
  /// f(texel, its place in texels_), for all of them.
  template <class F>
  void for_each_texel(const DoParts& do_parts, const F& f);
  /// Marks the cells that lie wholly in the cone.
  void hide(const HiddenCone& cone);
  /// Weights as means over RGB; the power of the map.
  double weigh_texels(const DoParts& do_parts);
  /// Weights less an offset, where positive, times a factor.
  void reduce_weights(double offset, double factor, const DoParts& do_parts);
  /// Edges of the cell that a texel owns; zero where it is hidden.
  Edges edges_of(const Texel* texel) const;
  /// Weight at a place down in the cell that a texel owns, on its left side (nearest: of all of
  /// it).
  double weight_down(const Texel* texel, double place) const;
  /// Integral of the weights over the visible cells.
  double integral_of_weights(const DoParts& do_parts) const;
  /// Mixes that share of capped weights in. power: integral of the weights, > 0.
  void cap_weights(float share, double power, const DoParts& do_parts);
  void build_table(bool compensate, float capped_share, const DoParts& do_parts);

  int width_ = 0, height_ = 0;
  MapFilter filter_ = MapFilter::bilinear;
  std::vector<Texel> texels_;
  std::vector<MapRow> rows_;  ///< (cell rows)
  /// Cumulative sums, in double: no dim cell is lost beside a sun. Of a row's cells only every
  /// kBlock-th sum is kept; between them the cells are added up again, so what is sampled is
  /// exactly what evaluate() reports.
  std::vector<double> row_cdf_;  ///< (cell rows + 1) probability
  /// Cumulative sums, (cell rows, ceil(W / kBlock) + 1) of the row.
  std::vector<Edges> block_cdf_;
  double total_power_ = 0;
};

/// The map of a file's picture as the environment says: scaled, repaired, and reduced to
/// max_width columns where it has more.
EnvironmentMap make_map(const RgbImage& picture, const EnvironmentSpec& environment,
                        bool compensate, const HiddenCone& hidden = {}, float capped_share = 0,
                        const DoParts& do_parts = do_in_turn);

/// A map turned by a rotation: what one frame is lit by.
struct Environment {
  std::shared_ptr<const EnvironmentMap> map;
  Mat3 rotation;  ///< world = rotation * map direction

  EnvironmentMap::Texel evaluate(const Vec3& world) const {
    return map->evaluate(rotation.transposed() * world);
  }
  Vec3 sample(const std::array<float, 2>& u) const { return rotation * map->sample(u); }
};

}  // namespace baton
