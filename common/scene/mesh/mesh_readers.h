#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/mesh/triangle_mesh.h"

namespace baton {

/// Readers of meshes, our own. `name` goes first in every error. Polygons are cut into triangles
/// (polygons.h); triangles without area are dropped and counted.

/// Geomview's OFF text: "OFF", "COFF", "NOFF" or "CNOFF", counts, then a vertex or a face per line.
/// '#' starts a comment anywhere; what follows the coordinates or the indices on a line (normals,
/// colours) is ignored. The mesh has no normals.
Result<TriangleMesh> parse_off(std::string_view text, const std::string& name);

/// Stanford's PLY, text or binary of either byte order: elements `vertex` (x, y, z; nx, ny, nz if
/// `with_normals`; red, green, blue, alpha, sRGB where they are integers), `face` (vertex_indices
/// or vertex_index) and `tristrips`, in any order; other elements and properties are skipped.
Result<TriangleMesh> parse_ply(std::string_view bytes, const std::string& name, bool with_normals);

/// Wavefront's OBJ: the faces of all its objects; normals if `with_normals`, texture coordinates if
/// `with_uvs`. Groups, materials, colours and surfaces of formulas are ignored.
Result<TriangleMesh> parse_obj(std::string_view text, const std::string& name, bool with_normals,
                               bool with_uvs);

}  // namespace baton
