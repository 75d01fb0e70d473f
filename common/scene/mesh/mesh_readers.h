#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/mesh/triangle_mesh.h"

namespace baton {

/// Readers of meshes. Those of scanned ones are our own: assimp 5.2 takes truncated OFF files and
/// wrong indices without a word and hangs or reads past the end on damaged PLY files. `name` goes
/// first in every error. Polygons are cut into fans; triangles without area are dropped and
/// counted.

/// Geomview's OFF text: "OFF", "COFF", "NOFF" or "CNOFF", counts, then a vertex or a face per line.
/// '#' starts a comment anywhere; what follows the coordinates or the indices on a line (normals,
/// colours) is ignored. The mesh has no normals.
Result<TriangleMesh> parse_off(std::string_view text, const std::string& name);

/// Stanford's PLY, text or binary of either byte order: elements `vertex` (x, y, z; nx, ny, nz if
/// `with_normals` and all usable) and `face` (vertex_indices or vertex_index); other elements and
/// properties are skipped.
Result<TriangleMesh> parse_ply(std::string_view bytes, const std::string& name, bool with_normals);

/// Wavefront's OBJ, by assimp: faces of all its objects; normals if `with_normals` and all usable,
/// texture coordinates if `with_uvs` and all objects have some. It may throw on odd files.
Result<TriangleMesh> read_obj(const std::string& path, bool with_normals, bool with_uvs);

}  // namespace baton
