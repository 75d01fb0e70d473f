#include "common/scene/gltf/meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/math/inverse.h"
#include "common/scene/gltf/accessor.h"
#include "common/scene/gltf/shaper.h"
#include "common/scene/gltf/vertices.h"
#include "common/scene/mesh/mesh_builder.h"

namespace baton::gltf {
namespace {

void add_triangles(const Vertices& v, const Matrix& to_file, const MeshParts& parts,
                   MeshBuilder& builder) {
  const Transform transform = to_transform(to_file);
  const Mat3 normal_to_file = inverse_transposed(transform.linear).value_or(Mat3{});
  const bool mirrored = determinant(to_file) < 0;
  builder.begin_part(v.positions.size() / 3);
  for (std::size_t i = 0; i < v.corners.size(); i += 3) {
    std::array<std::uint32_t, 3> vertices{};
    std::array<Vec3, 3> corners, normals;
    std::array<UvSets, 3> uvs{};
    std::array<Tangent, 3> tangents{};
    std::array<VertexColor, 3> colors{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = v.corners[i + (mirrored ? 2 - k : k)];
      vertices[k] = vertex;
      corners[k] = transform.point(vec3_at(v.positions, vertex));
      if (parts.normals && !v.normals.empty())
        normals[k] = normalize(normal_to_file * vec3_at(v.normals, vertex));
      for (std::size_t set = 0; set < static_cast<std::size_t>(parts.uv_sets); ++set)
        uvs[k][set] = {v.uvs[set][std::size_t{2} * vertex],
                       v.uvs[set][std::size_t{2} * vertex + 1]};
      if (parts.tangents) tangents[k] = tangent_at(v, vertex);
      if (parts.colors) colors[k] = v.colors.empty() ? VertexColor{1, 1, 1, 1} : v.colors[vertex];
    }
    builder.add(vertices, corners, normals, uvs, tangents, colors);
  }
}

/// A primitive of the file, its vertices and which of their parts are used.
struct Opened {
  Vertices vertices;
  MeshParts parts;
};

Result<Opened> open_primitive(const Document& document, const MeshSpec& spec) {
  const std::string place = place_of(spec.mesh, static_cast<std::size_t>(spec.primitive));
  const auto m = static_cast<std::size_t>(spec.mesh), p = static_cast<std::size_t>(spec.primitive);
  if (spec.mesh < 0 || m >= document.meshes.size() || spec.primitive < 0 ||
      p >= document.meshes[m].primitives.size())
    return document.error(place + ": not there");
  const Primitive& primitive = document.meshes[m].primitives[p];
  if (!has_surface(primitive))
    return document.error(place + ": expected triangles, found points or lines");
  BATON_ASSIGN(Vertices v, read_vertices(document, primitive, place));
  const bool with_normals = spec.smooth_normals && !v.normals.empty();
  const bool with_tangents = with_normals && is_bumpy(document, primitive) && !v.tangents.empty();
  const MeshParts parts{with_normals, v.num_uv_sets(), with_tangents, !v.colors.empty()};
  return Opened{std::move(v), parts};
}

/// Repairs of what is used.
MeshRepairs used_repairs(const Opened& opened) {
  MeshRepairs repairs = opened.vertices.repairs;
  if (!opened.parts.normals) repairs.normals = 0;
  if (!opened.parts.tangents) repairs.tangents = 0;
  return repairs;
}

Error without_triangles(const Document& document, const MeshSpec& spec, std::uint64_t dropped) {
  return document.error(fmt::format("{}: no triangles ({} without area)",
                                    place_of(spec.mesh, static_cast<std::size_t>(spec.primitive)),
                                    dropped));
}

/// May have no triangles.
TriangleMesh built_mesh(const Opened& opened) {
  MeshBuilder builder(opened.parts);
  add_triangles(opened.vertices, kIdentity, opened.parts, builder);
  TriangleMesh result = builder.take();
  result.repairs = used_repairs(opened);
  return result;
}

/// Puts what was shaped in the place of what was read.
void take_shape(const MeshShape& shape, Vertices& v) {
  const auto flat = [](const std::vector<Vec3>& vectors, std::vector<float>& numbers) {
    if (vectors.empty()) return;
    numbers.clear();
    for (const Vec3& p : vectors) numbers.insert(numbers.end(), {p.x, p.y, p.z});
  };
  flat(shape.positions, v.positions);
  flat(shape.normals, v.normals);
  for (std::size_t i = 0; i < shape.tangents.size(); ++i) {
    const Tangent& t = shape.tangents[i];
    const std::array<float, 4> numbers{t.direction.x, t.direction.y, t.direction.z, t.side};
    std::copy(numbers.begin(), numbers.end(),
              v.tangents.begin() + static_cast<std::ptrdiff_t>(4 * i));
  }
}

/// A primitive that the animations of its file deform.
class AnimatedShape final : public Deformation {
 public:
  AnimatedShape(std::shared_ptr<const NodeMotion> motion, const ShapeSpec& by, Shaper shaper)
      : motion_(std::move(motion)), by_(by), shaper_(std::move(shaper)) {}

  MeshShape at(double frame) const override {
    const double seconds = by_.animation->seconds_at(frame);
    return shaper_.shape(motion_->to_world(seconds), motion_->weights(by_.node, seconds));
  }
  std::array<double, 2> moving_frames() const override {
    const auto [first, last] = motion_->seconds().value_or(std::array<double, 2>{});
    return {by_.animation->frame_at(first), by_.animation->frame_at(last)};
  }
  std::uint64_t size_bytes() const override { return shaper_.size_bytes(); }

 private:
  const std::shared_ptr<const NodeMotion> motion_;  ///< meshes share it
  const ShapeSpec by_;
  const Shaper shaper_;
};

/// Vertices and triangles as the file lists them, in a shape: those that are alike in it may part
/// in another.
Result<TriangleMesh> listed_mesh(const Document& document, const MeshSpec& spec, Opened opened,
                                 MeshShape shape) {
  TriangleMesh mesh;
  const std::vector<std::uint32_t>& corners = opened.vertices.corners;
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    const std::array<std::uint32_t, 3> triangle{corners[i], corners[i + 1], corners[i + 2]};
    if (std::set(triangle.begin(), triangle.end()).size() == 3) {
      mesh.triangles.push_back(triangle);
    } else {
      ++mesh.dropped_triangles;
    }
  }
  if (mesh.triangles.empty()) return without_triangles(document, spec, mesh.dropped_triangles);
  mesh.repairs = used_repairs(opened);
  for (std::size_t set = 0; set < static_cast<std::size_t>(opened.parts.uv_sets); ++set) {
    for (std::size_t i = 0; i < opened.vertices.uvs[set].size(); i += 2)
      mesh.uvs[set].push_back({opened.vertices.uvs[set][i], opened.vertices.uvs[set][i + 1]});
  }
  mesh.colors = std::move(opened.vertices.colors);
  mesh.positions = std::move(shape.positions);
  mesh.normals = std::move(shape.normals);
  mesh.tangents = std::move(shape.tangents);
  return mesh;
}

}  // namespace

Shaping shaping_of(const NodeMotion& motion, int node) {
  const Document& document = motion.document();
  const Node& given = document.nodes[static_cast<std::size_t>(node)];
  if (given.mesh < 0) return Shaping::none;
  bool moves = motion.morphs(node);
  if (given.skin >= 0) {
    const std::vector<int>& joints = document.skins[static_cast<std::size_t>(given.skin)].joints;
    moves = moves || std::ranges::any_of(joints, [&](int joint) { return motion.moves(joint); });
  }
  if (moves) return Shaping::animated;
  const std::vector<double> weights = NodeMotion::weights_at_rest(document, node);
  const bool rests = std::ranges::all_of(weights, [](double weight) { return weight == 0; });
  return given.skin >= 0 || !rests ? Shaping::at_rest : Shaping::none;
}

Result<Instances> instances_of(const Document& document, const Node& node) {
  std::size_t count = 1;
  for (const int accessor :
       {node.instance_translations, node.instance_rotations, node.instance_scales}) {
    if (accessor >= 0) count = document.accessors[static_cast<std::size_t>(accessor)].count;
  }
  const auto read = [&](int accessor, int width, const char* name,
                        float otherwise) -> Result<std::vector<float>> {
    if (accessor < 0) return std::vector<float>(count * static_cast<std::size_t>(width), otherwise);
    return read_attribute(document, accessor, width, count, "EXT_mesh_gpu_instancing", name);
  };
  BATON_ASSIGN(const std::vector<float> t, read(node.instance_translations, 3, "TRANSLATION", 0));
  BATON_ASSIGN(const std::vector<float> r, read(node.instance_rotations, 4, "ROTATION", 0));
  BATON_ASSIGN(const std::vector<float> s, read(node.instance_scales, 3, "SCALE", 1));
  Instances instances;
  for (std::size_t i = 0; i < count; ++i) {
    if (!is_finite(t, 3, i) || !is_finite(r, 4, i) || !is_finite(s, 3, i)) {
      ++instances.num_nowhere;
      continue;
    }
    const float* const q = r.data() + 4 * i;
    const double length = std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] +
                                    double{q[2]} * q[2] + double{q[3]} * q[3]);
    instances.num_unturned += node.instance_rotations < 0 || length > 0 ? 0 : 1;
    const Quaternion turn =
        length > 0 ? Quaternion{q[0] / length, q[1] / length, q[2] / length, q[3] / length}
                   : Quaternion{};
    instances.places.push_back(compose({t[3 * i], t[3 * i + 1], t[3 * i + 2]}, turn,
                                       {s[3 * i], s[3 * i + 1], s[3 * i + 2]}));
  }
  return instances;
}

Result<TriangleMesh> primitive_mesh(const Document& document, const MeshSpec& spec) {
  BATON_ASSIGN(const Opened opened, open_primitive(document, spec));
  TriangleMesh mesh = built_mesh(opened);
  if (mesh.triangles.empty()) return without_triangles(document, spec, mesh.dropped_triangles);
  return mesh;
}

Result<TriangleMesh> shaped_mesh(const Document& document, std::shared_ptr<const NodeMotion> motion,
                                 const MeshSpec& spec) {
  const ShapeSpec& by = *spec.shaped_by;
  const auto node = static_cast<std::size_t>(by.node);
  if (node >= document.nodes.size() || document.nodes[node].mesh != spec.mesh)
    return document.error(fmt::format("expected a node that shows mesh {}, which node {} does not",
                                      spec.mesh, by.node));
  BATON_ASSIGN(Opened opened, open_primitive(document, spec));
  BATON_ASSIGN(Shaper shaper,
               Shaper::read(document, by.node, static_cast<std::size_t>(spec.primitive),
                            opened.vertices, opened.parts.normals, opened.parts.tangents));
  opened.vertices.repairs += shaper.repairs();
  if (by.animation) {
    const auto deformation =
        std::make_shared<const AnimatedShape>(std::move(motion), by, std::move(shaper));
    BATON_ASSIGN(TriangleMesh mesh, listed_mesh(document, spec, std::move(opened),
                                                deformation->at(by.animation->start_frame)));
    mesh.deformation = deformation;
    return mesh;
  }
  MeshShape shape = shaper.shape(motion->at_rest(), NodeMotion::weights_at_rest(document, by.node));
  take_shape(shape, opened.vertices);
  TriangleMesh mesh = built_mesh(opened);
  if (!mesh.triangles.empty()) return mesh;
  // What has area in another shape is there, and no ray meets it.
  opened.vertices.repairs.shrunk = 1;
  return listed_mesh(document, spec, std::move(opened), std::move(shape));
}

void place(const std::vector<PlacedNode>& places, NodeMotion& motion) {
  for (const PlacedNode& placed : places) {
    Matrix local;
    std::copy(placed.matrix.begin(), placed.matrix.end(), local.begin());
    motion.place(placed.node, local);
  }
}

Result<std::shared_ptr<const NodeMotion>> MotionCache::get(
    const std::shared_ptr<const Document>& document, const ShapeSpec& by) {
  const std::string animation = by.animation ? by.animation->animation : "";
  for (const Entry& entry : entries_) {
    if (entry.document == document && entry.places == by.places && entry.animation == animation)
      return entry.motion;
  }
  BATON_ASSIGN(NodeMotion motion, NodeMotion::read(document, animation));
  for (const PlacedNode& placed : by.places) {
    if (static_cast<std::size_t>(placed.node) >= document->nodes.size())
      return document->error(fmt::format("expected places of nodes below {}, got node {}",
                                         document->nodes.size(), placed.node));
  }
  place(by.places, motion);
  motion.let_go_of_buffers();
  entries_.push_back(
      {document, by.places, animation, std::make_shared<const NodeMotion>(std::move(motion))});
  return entries_.back().motion;
}

Result<TriangleMesh> whole_mesh(const Document& document, bool smooth_normals) {
  struct Part {
    Vertices vertices;
    Matrix to_file;
  };
  const std::vector<Matrix> to_world = NodeMotion::at_rest(document);
  std::vector<Part> parts;
  MeshParts common{.normals = smooth_normals, .uv_sets = 2};
  bool any_normals = false;
  MeshRepairs repairs;
  for (const int node : shown_nodes(document)) {
    const int mesh = document.nodes[static_cast<std::size_t>(node)].mesh;
    if (mesh < 0) continue;
    const Mesh& given = document.meshes[static_cast<std::size_t>(mesh)];
    const Matrix& to_file = document.nodes[static_cast<std::size_t>(node)].skin >= 0
                                ? kIdentity
                                : to_world[static_cast<std::size_t>(node)];
    BATON_ASSIGN(const Instances instances,
                 instances_of(document, document.nodes[static_cast<std::size_t>(node)]));
    repairs.instances += instances.num_nowhere;
    for (std::size_t p = 0; p < given.primitives.size(); ++p) {
      if (!has_surface(given.primitives[p])) continue;
      BATON_ASSIGN(Vertices v, read_vertices(document, given.primitives[p], place_of(mesh, p)));
      BATON_ASSIGN(const Shaper shaper,
                   Shaper::read(document, node, p, v, !v.normals.empty(), false));
      if (!shaper.is_idle())
        take_shape(shaper.shape(to_world, NodeMotion::weights_at_rest(document, node)), v);
      any_normals = any_normals || !v.normals.empty();
      repairs += v.repairs;
      repairs += shaper.repairs();
      common.colors = common.colors || !v.colors.empty();
      common.uv_sets = std::min(common.uv_sets, v.num_uv_sets());
      for (const Matrix& at : instances.places) parts.push_back({v, multiply(to_file, at)});
    }
  }
  common.normals = smooth_normals && any_normals;
  MeshBuilder builder(common);
  for (const Part& part : parts) add_triangles(part.vertices, part.to_file, common, builder);
  TriangleMesh mesh = builder.take();
  if (const std::string found = surfaceless_parts(document);
      mesh.triangles.empty() && !found.empty())
    return document.error("nothing to show: it has " + found + " and no triangles");
  repairs.tangents = 0;  // it has none
  if (!common.normals) repairs.normals = 0;
  if (common.uv_sets == 0) repairs.uvs = 0;
  mesh.repairs += repairs;
  return mesh;
}

}  // namespace baton::gltf
