#pragma once

#include <set>
#include <string>

#include "common/base/result.h"
#include "common/scene/mesh/triangle_mesh.h"

namespace baton {

/// Reads .ply .obj .off .gltf .glb. with_uvs: of .obj files, too, whose vertices then part where
/// their texture coordinates do. Errors name the file: missing, not a mesh, no triangles,
/// indices out of range, coordinates that are not finite. listed: as for gltf::read_document.
Result<TriangleMesh> load_mesh(const std::string& path, bool smooth_normals, bool with_uvs = false,
                               const std::set<std::string>* listed = nullptr);

}  // namespace baton
