#pragma once

#include "worker/scene/gltf/document.h"
#include "worker/scene/scene.h"

namespace baton::gltf {

/// The triangles of one primitive, in the space of its mesh, with the UV sets that it has. Without
/// normals of its own it is flat, as glTF says. Errors name file and place: accessors that do not
/// fit, indices out of range, coordinates that are not finite, no triangles.
Result<TriangleMesh> primitive_mesh(const Document& document, int mesh, int primitive,
                                    bool smooth_normals);

/// All that the scene of a file shows, in its world, at rest; with the UV sets that all of it has.
/// The mesh has no normals where a part has none.
Result<TriangleMesh> whole_mesh(const Document& document, bool smooth_normals);

}  // namespace baton::gltf
