#pragma once

#include <memory>
#include <vector>

#include "common/job/scene_spec.h"
#include "common/scene/gltf/node_motion.h"
#include "common/scene/mesh/triangle_mesh.h"

namespace baton::gltf {

/// What a node does to the vertices of its mesh.
enum class Shaping : std::uint8_t {
  none,
  /// A skin or morph weights shape them once and for all.
  at_rest,
  animated,  ///< animations do
};
Shaping shaping_of(const NodeMotion& motion, int node);

/// Where a node shows its mesh, in its own space.
struct Instances {
  std::vector<Matrix> places;
  std::uint64_t num_nowhere = 0;  ///< more, whose numbers are not finite
  /// With a rotation of zeros, which turns nothing.
  std::uint64_t num_unturned = 0;
};
/// Once, or at each place that the file lists (EXT_mesh_gpu_instancing). Errors: lists of unequal
/// length.
Result<Instances> instances_of(const Document& document, const Node& node);

/// The triangles of one primitive, in the space of its mesh, with the UV sets that it has. Without
/// normals of its own it is flat, as glTF says. Errors name file and place: accessors that do not
/// fit, indices out of range, no triangles.
Result<TriangleMesh> primitive_mesh(const Document& document, const MeshSpec& spec);

/// The same as spec.shaped_by, which is there, shapes it: posed, or with a deformation. motion: of
/// the file, with the places of its nodes. More errors: those of shaper.h, a node that does not
/// show the mesh.
Result<TriangleMesh> shaped_mesh(const Document& document, std::shared_ptr<const NodeMotion> motion,
                                 const MeshSpec& spec);

/// All that the scene of a file shows, in its world, at rest; with the UV sets that all of it has.
/// Parts without normals take smooth ones where others have some; without any the mesh has none.
Result<TriangleMesh> whole_mesh(const Document& document, bool smooth_normals);

/// Puts nodes elsewhere. Their places must be there.
void place(const std::vector<PlacedNode>& places, NodeMotion& motion);

/// Reads the animations of each file once for all that is placed alike. Not for several threads.
class MotionCache {
 public:
  /// The nodes as `by` places and moves them. Errors: those of NodeMotion, a place of a node that
  /// is not there.
  Result<std::shared_ptr<const NodeMotion>> get(const std::shared_ptr<const Document>& document,
                                                const ShapeSpec& by);

 private:
  struct Entry {
    std::shared_ptr<const Document> document;
    std::vector<PlacedNode> places;
    std::string animation;
    std::shared_ptr<const NodeMotion> motion;
  };
  std::vector<Entry> entries_;
};

}  // namespace baton::gltf
