#pragma once

namespace baton {

/// Where the density that goes linearly from `first` at 0 to `last` at 1 has the share u of its
/// integral below it, in [0, 1]. first, last: not negative. u: in [0, 1].
double place_in_linear(double first, double last, double u);

/// A row of cells of a lat-long map, between two polar angles. Functions of it go linearly from its
/// upper edge to its lower one.
class MapRow {
 public:
  /// top < bottom: polar angles of its edges, in [0, pi]. width: of the map, in cells.
  MapRow(double top, double bottom, int width);

  /// Integral over one cell of a function that is the mean of `upper` along its upper edge and of
  /// `lower` along the lower one: no more is needed of it, as a cell is as wide at all its angles.
  double integral(double upper, double lower) const {
    return upper * upper_weight_ + lower * lower_weight_;
  }
  /// How far down in the row, in [0, 1], a share u of such a function's integral lies above.
  double place(double upper, double lower, double u) const;
  /// Polar angle there.
  double angle(double place) const { return top_ + place * height_; }
  /// Errors of the lattice of carried directions, in cells: from the left or right, at most half,
  /// and from above or below.
  double margin_across() const { return margin_across_; }
  double margin_down() const { return margin_down_; }

 private:
  double top_, height_, middle_;  ///< polar angles
  double sin_top_, cos_top_, sin_bottom_, cos_bottom_;
  double upper_weight_, lower_weight_;  ///< integral() of (1, 0), of (0, 1): sr
  double margin_across_, margin_down_;
};

}  // namespace baton
