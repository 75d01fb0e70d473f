#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/math/vec3.h"

namespace baton {

/// Which way the first texture coordinate grows.
struct Tangent {
  Vec3 direction;  ///< unit, at a right angle to the normal
  /// side * cross(normal, direction) points up in the image: 1 or -1.
  float side = 1;

  bool operator==(const Tangent&) const = default;
};

/// The vertices of a mesh in one frame.
struct MeshShape {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;      ///< unit; empty: flat shading
  std::vector<Tangent> tangents;  ///< or empty

  std::uint64_t size_bytes() const {
    return (positions.capacity() + normals.capacity()) * sizeof(Vec3) +
           tangents.capacity() * sizeof(Tangent);
  }
};

/// How the vertices of a mesh move. Immutable; any number of threads may ask.
class Deformation {
 public:
  virtual ~Deformation() = default;
  /// Where they are at a frame number, finite: a pure function. Those of one mesh have the same
  /// parts in all frames.
  virtual MeshShape at(double frame) const = 0;
  /// The frame numbers between which it moves; it rests before and behind them.
  virtual std::array<double, 2> moving_frames() const = 0;
  virtual std::uint64_t size_bytes() const = 0;
};

}  // namespace baton
