#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"
#include "common/scene/mesh/triangle_mesh.h"

namespace baton {

/// Readers of meshes, our own. `name` goes first in every error. Polygons are cut into triangles
/// (polygons.h); triangles without area are dropped and counted. Texts may begin with a byte order
/// mark of UTF-8; their lines end in "\n", "\r\n" or "\r".

/// Geomview's OFF text: "[ST][C][N][4][n]OFF" or no such word, counts, vertices, faces; a vertex of
/// "4OFF" is divided by its fourth number. '#' starts a comment anywhere. Where each vertex and
/// face has a line of its own, what follows the coordinates or the indices there (normals, colours,
/// texture coordinates) is ignored, whatever the first word says of it; else vertices have just
/// what it says. The mesh has no normals.
Result<TriangleMesh> parse_off(std::string_view text, const std::string& name);

/// Stanford's PLY, text or binary of either byte order: elements `vertex` (x, y, z; nx, ny, nz if
/// `with_normals`; red, green, blue, alpha, sRGB where they are integers), `face` (vertex_indices
/// or vertex_index) and `tristrips`, in any order; other elements and properties are skipped.
Result<TriangleMesh> parse_ply(std::string_view bytes, const std::string& name, bool with_normals);

/// Wavefront's OBJ: the faces of all its objects; normals if `with_normals`, texture coordinates if
/// `with_uvs`. Faces may come before the vertices that they name. Groups and materials are ignored;
/// colours, surfaces of formulas and lines that are not known are left out and counted.
Result<TriangleMesh> parse_obj(std::string_view text, const std::string& name, bool with_normals,
                               bool with_uvs);

}  // namespace baton
