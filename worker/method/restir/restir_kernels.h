#pragma once

#include "worker/light/candidates.h"
#include "worker/method/carried/carried_light.h"
#include "worker/method/carried/old_surfaces.h"
#include "worker/sampling/restir.h"

namespace baton::kernels {

/// The samples of all sets of one pixel, set after set, and what they are worth.
struct RestirPoints {
  static constexpr std::size_t kMost = kMaxRestirSets * limits::kMaxParticles;
  template <class T>
  using Column = PaddedArray<T, kMost>;
  Column<OctDirection> code;
  Column<std::uint8_t> site;
  Column<float> r, g, b;                            ///< (f cos L)_rgb of now
  Column<float> target_now;                         ///< p~, their mean
  Column<float> target_before[kMaxRestirSets - 1];  ///< p~ of each carried set
  Column<float> contribution;                       ///< u
  Column<float> weight;
};

/// What is asked of the points [first, last).
struct PointRange {
  std::size_t first = 0, last = 0;
  bool wants_now = false;  ///< colours and target of now
  /// Targets of the carried sets first_old, ... are needed as well.
  std::size_t first_old = 0;
};

/// Turns the directions of points [first, last) and rounds them to the lattice. Codes past the last
/// one are read up to a vector's end.
void turn_points(const Mat3& turn, std::size_t first, std::size_t last, RestirPoints& points);

/// Evaluates points under the surfaces and the light of now, and under those that the carried sets
/// come from: the light of the frame before, and `old` surfaces by sites of this frame, null where
/// they are `sites`. With light.turn the carried sets are taken to have been turned by it: their
/// target at y is that of then at turn^-1 y, so their surfaces are seen from there, under the light
/// of now at y. Codes and sites past the last point are read up to a vector's end.
void evaluate_points(const SiteBlock& sites, std::span<const OldSurfaces* const> old,
                     const CarriedLight& light, const PointRange& range, RestirPoints& points);

}  // namespace baton::kernels
