#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/gltf/matrix.h"

namespace baton::gltf {

/// Values over time, (times, width); cubic: (times, 3, width) with the tangents before and behind.
struct Curve {
  Interpolation interpolation = Interpolation::linear;
  /// Seconds, ascending, at least one. Two may be alike: the curve jumps from one to the other.
  std::vector<float> times;
  std::vector<float> values;

  /// Rotations are unit quaternions. Held before the first time and after the last one. A key shows
  /// from its time on, up to the rounding of times in files.
  std::array<double, 3> vector_at(double seconds) const;
  Quaternion rotation_at(double seconds) const;
  /// All numbers of a time, each by itself.
  std::vector<double> values_at(double seconds) const;
};

/// Keys of curves that could not be used as they are.
struct KeyRepairs {
  std::size_t repeated = 0;  ///< another one before them has their time
  /// Their time or value is not finite, or a rotation of zeros: left out.
  std::size_t unusable = 0;
  std::size_t slopes = 0;  ///< their tangents are not finite: 0
  /// Earlier than the one before them: put into order.
  std::size_t unordered = 0;
  /// Without a key that can be used: nothing moves by them.
  std::size_t empty_curves = 0;
};

/// Where the nodes of a file are at any time: all its animations together, or one of them. Where
/// several move one property of a node, the first in the file counts.
class NodeMotion {
 public:
  /// animation: the one that plays, as names.h finds it; empty: all. Errors name the file and the
  /// accessor.
  static Result<NodeMotion> read(std::shared_ptr<const Document> document,
                                 const std::string& animation = "");

  const Document& document() const { return *document_; }
  /// What is odd about the animations and read in spite of that, a line each: keys at one time,
  /// where curves jump, keys that are not finite or out of order, weights of what has no
  /// targets, animations that move the same.
  std::vector<std::string> notes() const;
  /// Lets go of all of the document but its nodes, skins and what its meshes are called and made
  /// of: motion that is kept needs no more.
  void let_go_of_buffers();
  /// The only node of a name. Error: none, or several.
  Result<int> find(const std::string& name) const;
  /// Whether a node, or one above it, is moved by an animation.
  bool moves(int node) const { return moves_[static_cast<std::size_t>(node)]; }
  /// Whether the morph weights of a node are.
  bool morphs(int node) const {
    return curves_[static_cast<std::size_t>(node)].weights.has_value();
  }
  /// The times of the first key and of the last one; none: nothing moves.
  std::optional<std::array<double, 2>> seconds() const;
  /// Puts a node elsewhere below its parent, and at rest there.
  void place(int node, const Matrix& local);
  /// From each node to the world of the file.
  std::vector<Matrix> to_world(double seconds) const;
  /// The same without the animations.
  std::vector<Matrix> at_rest() const;
  /// The same as the file places them.
  static std::vector<Matrix> at_rest(const Document& document);

  /// How far the targets of a node's mesh are added to it.
  std::vector<double> weights(int node, double seconds) const;
  /// The same without the animations.
  static std::vector<double> weights_at_rest(const Document& document, int node);

 private:
  struct Moved {
    std::optional<Curve> translation, rotation, scale, weights;
    std::optional<Matrix> placed;
    bool any() const { return !placed && (translation || rotation || scale); }
  };
  Matrix local(std::size_t node, double seconds) const;
  void find_what_moves();

  std::shared_ptr<const Document> document_;
  std::vector<int> order_;     ///< all nodes, parents first
  std::vector<Moved> curves_;  ///< by node
  std::vector<bool> moves_;    ///< by node
  KeyRepairs repairs_;
  std::size_t num_idle_channels_ = 0, num_second_channels_ = 0;
};

}  // namespace baton::gltf
