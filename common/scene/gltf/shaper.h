#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/gltf/matrix.h"
#include "common/scene/gltf/vertices.h"
#include "common/scene/mesh/deformation.h"

namespace baton::gltf {

/// Moves the vertices of a primitive as a node shapes them: by the morph targets of its mesh, then
/// by its skin [glTF 2.0, sections 3.7.2.2 and 3.7.3].
class Shaper {
 public:
  /// v: the vertices of the primitive of the node's mesh. parts: which of them are moved. Numbers
  /// that cannot be used count as 0 (repairs). Errors name the file and the place: targets and
  /// joints that do not fit the vertices, joints that the skin does not have, a skin with too few
  /// matrices.
  static Result<Shaper> read(const Document& document, int node, std::size_t primitive,
                             const Vertices& v, bool with_normals, bool with_tangents);

  /// Whether nothing moves them, ever.
  bool is_idle() const { return targets_.empty() && joints_.empty(); }
  /// to_world: by node. weights: of the targets. With a skin the result is in the world, else in
  /// the space of the mesh.
  MeshShape shape(std::span<const Matrix> to_world, std::span<const double> weights) const;
  std::uint64_t size_bytes() const;
  /// Made of joints, weights and targets. Vertices without a joint of some weight follow the first
  /// joint of the skin.
  const MeshRepairs& repairs() const { return repairs_; }

 private:
  /// What a target adds to a vertex.
  struct Delta {
    std::uint32_t vertex;
    std::array<float, 3> step;
  };
  struct Target {
    std::vector<Delta> positions, normals, tangents;  ///< those that are not 0
  };
  struct Influence {
    std::uint32_t joint;
    float weight;  ///< above 0
  };

  Status read_targets(const Document& document, const Primitive& given, const std::string& place);
  Status read_skin(const Document& document, int skin, const Primitive& given,
                   const std::string& place);
  Status read_binds(const Document& document, int skin);
  Status read_joints(const Document& document, const Primitive& given, const std::string& place);
  Matrix blend(std::span<const Matrix> joints, std::size_t vertex) const;

  std::vector<float> positions_, normals_, tangents_;  ///< (vertices, 3), (vertices, 4); as read
  std::vector<Target> targets_;
  std::vector<int> joints_;        ///< nodes; empty: no skin
  std::vector<Matrix> from_mesh_;  ///< by joint, the inverse bind matrices
  /// By joint, whether the file's matrix is finite.
  std::vector<bool> holds_;
  std::vector<std::size_t> first_;  ///< (vertices + 1) of influences_
  std::vector<Influence> influences_;
  MeshRepairs repairs_{};
};

}  // namespace baton::gltf
