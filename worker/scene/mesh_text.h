#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"
#include "worker/scene/scene.h"

namespace baton {

/// Reads Geomview's OFF text: "OFF", "COFF", "NOFF" or "CNOFF", counts, then a vertex or a face per
/// line. '#' starts a comment anywhere; what follows the coordinates or the indices on a line
/// (normals, colours) is ignored; polygons are cut into fans. Our own because assimp's reader takes
/// truncated files and wrong indices without a word. The mesh has no normals. `name` goes first in
/// every error, then the line.
Result<TriangleMesh> parse_off(std::string_view text, const std::string& name);

/// What is missing from a PLY file that is shorter than its header promises; nullopt when it is
/// long enough or has no readable header. assimp's reader would fill the gap with what it finds in
/// memory.
std::optional<std::string> find_ply_truncation(std::string_view bytes);

}  // namespace baton
