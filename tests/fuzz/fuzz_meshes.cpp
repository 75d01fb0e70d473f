#include <algorithm>
#include <cmath>

#include "common/scene/gltf/meshes.h"
#include "common/scene/mesh/mesh_builder.h"
#include "common/scene/mesh/mesh_readers.h"
#include "tests/fuzz/fuzz_target.h"

namespace baton {
namespace {

/// What everything after the reader relies on.
void look_at(const Result<TriangleMesh>& mesh) {
  if (!mesh) return;
  const auto finite = [](const Vec3& v) {
    return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
  };
  BATON_CHECK(std::ranges::all_of(mesh->positions, finite));
  BATON_CHECK(mesh->normals.empty() || mesh->normals.size() == mesh->positions.size());
  BATON_CHECK(std::ranges::all_of(mesh->normals, finite));
  for (const auto& triangle : mesh->triangles) {
    for (const std::uint32_t index : triangle) BATON_CHECK(index < mesh->positions.size());
  }
  BATON_CHECK(std::ranges::all_of(smooth_vertex_normals(mesh->positions, mesh->triangles), finite));
}

/// What nodes shape, at rest and at times between the keys.
void look_at_shapes(const std::shared_ptr<const gltf::Document>& document) {
  const auto motion = gltf::MotionCache().get(document, {});
  if (!motion) return;
  (*motion)->to_world(0.5);
  for (const int node : gltf::shown_nodes(*document)) {
    const gltf::Shaping shaping = gltf::shaping_of(**motion, node);
    if (shaping == gltf::Shaping::none) continue;
    MeshSpec spec{.path = {},
                  .mesh = document->nodes[static_cast<std::size_t>(node)].mesh,
                  .shaped_by = ShapeSpec{.node = node}};
    look_at(gltf::shaped_mesh(*document, *motion, spec));
    spec.shaped_by->animation = FileClock{};
    Result<TriangleMesh> mesh = gltf::shaped_mesh(*document, *motion, spec);
    look_at(mesh);
    for (const double frame : {0.0, 7.5}) {
      if (!mesh) break;
      MeshShape shape = mesh->shape_at(frame);
      mesh->positions = std::move(shape.positions);
      mesh->normals = std::move(shape.normals);
      look_at(mesh);
    }
  }
}

}  // namespace
}  // namespace baton

/// The formats of single meshes.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace baton;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (text.starts_with("ply")) {
    look_at(parse_ply(text, "fuzz.ply", false));
    look_at(parse_ply(text, "fuzz.ply", true));
  } else if (text.starts_with("glTF") || text.starts_with("{")) {
    const auto document = gltf::parse_document(as_bytes_view(text), "/nowhere/fuzz.gltf");
    if (!document) return 0;
    look_at(gltf::whole_mesh(**document, true));
    look_at_shapes(*document);
  } else {
    look_at(parse_off(text, "fuzz.off"));
  }
  return 0;
}
