#include "common/scene/gltf/document_parser.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>

namespace baton::gltf {
namespace {

std::size_t count_of(const JsonView& root, const char* key) {
  std::size_t count = 0;
  root.each(key, [&](const JsonView&) { ++count; });
  return count;
}

Component parse_component(const JsonView& owner) {
  constexpr std::array<std::uint64_t, 6> kTypes{5120, 5121, 5122, 5123, 5125, 5126};  // Component
  const auto* const found = std::ranges::find(kTypes, owner.size("componentType"));
  if (found != kTypes.end()) return static_cast<Component>(found - kTypes.begin());
  owner.at("componentType").fail("expected one of 5120 to 5123, 5125, 5126");
  return Component::f32;
}

int parse_width(const JsonView& accessor) {
  constexpr std::array<std::pair<const char*, int>, 7> kTypes{{{"SCALAR", 1},
                                                               {"VEC2", 2},
                                                               {"VEC3", 3},
                                                               {"VEC4", 4},
                                                               {"MAT2", 4},
                                                               {"MAT3", 9},
                                                               {"MAT4", 16}}};
  const std::string type = accessor.text("type");
  for (const auto& [name, width] : kTypes) {
    if (type == name) return width;
  }
  accessor.at("type").fail("expected SCALAR, VEC2 to VEC4 or MAT2 to MAT4");
  return 1;
}

View parse_view(const JsonView& view, std::size_t num_buffers) {
  return {.buffer = view.required_index("buffer", num_buffers),
          .offset = view.size("byteOffset"),
          .size = view.size("byteLength"),
          .stride = view.size("byteStride")};
}

Accessor parse_accessor(const JsonView& accessor, std::size_t num_views) {
  Accessor read;
  read.view = accessor.index("bufferView", num_views);
  read.offset = accessor.size("byteOffset");
  read.count = accessor.size("count");
  read.component = parse_component(accessor);
  read.width = parse_width(accessor);
  read.normalized = accessor.boolean("normalized");
  if (const JsonView sparse = accessor.at("sparse")) {
    const JsonView indices = sparse.at("indices"), values = sparse.at("values");
    read.sparse = {.count = sparse.size("count"),
                   .indices = indices.required_index("bufferView", num_views),
                   .indices_offset = indices.size("byteOffset"),
                   .indices_component = parse_component(indices),
                   .values = values.required_index("bufferView", num_views),
                   .values_offset = values.size("byteOffset")};
  }
  return read;
}

/// Both of a set, and no set without the ones before it.
std::vector<JointSet> parse_joint_sets(const JsonView& attributes, std::size_t num_accessors) {
  std::vector<JointSet> sets;
  while (true) {
    const std::string number = std::to_string(sets.size());
    const std::string joints = "JOINTS_" + number, weights = "WEIGHTS_" + number;
    const bool has_joints = attributes.has(joints.c_str());
    if (has_joints != attributes.has(weights.c_str()))
      attributes.fail("expected " + joints + " and " + weights + ", or neither");
    if (!has_joints || !attributes.has(weights.c_str())) return sets;
    sets.push_back({attributes.index(joints.c_str(), num_accessors),
                    attributes.index(weights.c_str(), num_accessors)});
  }
}

/// Makes the weights of `owner` as many as there are morph targets, if it has any.
void fit_weights(const JsonView& owner, std::size_t num_targets, std::vector<double>& weights,
                 std::vector<std::string>& notes) {
  if (weights.empty() || weights.size() == num_targets) return;
  notes.push_back(
      fmt::format("{}.weights: {} for {} morph targets: those that are missing count "
                  "as 0, others are left out",
                  owner.place(), weights.size(), num_targets));
  weights.resize(num_targets);
}

Primitive parse_primitive(const JsonView& primitive, std::size_t num_accessors,
                          std::size_t num_materials) {
  Primitive read;
  read.mode = static_cast<int>(std::min<std::uint64_t>(primitive.size("mode", 4), 7));
  read.material = primitive.index("material", num_materials);
  read.indices = primitive.index("indices", num_accessors);
  const JsonView attributes = primitive.at("attributes");
  read.positions = attributes.index("POSITION", num_accessors);
  read.normals = attributes.index("NORMAL", num_accessors);
  read.tangents = attributes.index("TANGENT", num_accessors);
  read.uvs = {attributes.index("TEXCOORD_0", num_accessors),
              attributes.index("TEXCOORD_1", num_accessors)};
  read.colors = attributes.index("COLOR_0", num_accessors);
  attributes.each_member([&](const std::string& name) {
    const int accessor = attributes.index(name.c_str(), num_accessors);
    if (accessor >= 0) read.attributes.emplace(name, accessor);
  });
  read.joint_sets = parse_joint_sets(attributes, num_accessors);
  primitive.each("targets", [&](const JsonView& target) {
    read.targets.push_back({.positions = target.index("POSITION", num_accessors),
                            .normals = target.index("NORMAL", num_accessors),
                            .tangents = target.index("TANGENT", num_accessors)});
    const MorphTarget& t = read.targets.back();
    const auto known = (t.positions >= 0) + (t.normals >= 0) + (t.tangents >= 0);
    read.morphs_more = read.morphs_more || target.num_members() > static_cast<std::size_t>(known);
  });
  return read;
}

Mesh parse_mesh(const JsonView& mesh, std::size_t num_accessors, std::size_t num_materials,
                std::vector<std::string>& notes) {
  Mesh read{mesh.name("name"), {}, mesh.all_numbers("weights")};
  mesh.each("primitives", [&](const JsonView& primitive) {
    read.primitives.push_back(parse_primitive(primitive, num_accessors, num_materials));
  });
  const std::size_t most = read.num_targets();
  const auto lacks = std::ranges::count_if(
      read.primitives, [&](const Primitive& p) { return p.targets.size() < most; });
  if (lacks > 0)
    notes.push_back(
        fmt::format("{}: {} of {} parts have fewer than {} morph targets: those that "
                    "are missing do not move them",
                    mesh.place(), lacks, read.primitives.size(), most));
  fit_weights(mesh, most, read.weights, notes);
  return read;
}

Skin parse_skin(const JsonView& skin, std::size_t num_accessors, std::size_t num_nodes) {
  Skin read;
  read.inverse_binds = skin.index("inverseBindMatrices", num_accessors);
  std::set<int> seen;
  skin.each("joints", [&](const JsonView& joint) {
    read.joints.push_back(joint.as_index(num_nodes));
    if (!seen.insert(read.joints.back()).second) joint.fail("a joint of the skin already");
  });
  if (read.joints.empty()) skin.at("joints").fail("expected at least one joint");
  return read;
}

struct NodeLimits {
  std::size_t nodes, meshes, cameras, skins, accessors;
};

Node parse_node(const JsonView& node, const NodeLimits& limits) {
  Node read;
  read.name = node.name("name");
  read.mesh = node.index("mesh", limits.meshes);
  read.camera = node.index("camera", limits.cameras);
  read.skin = node.index("skin", limits.skins);
  node.each("children", [&](const JsonView& child) {
    if (const int index = child.as_index(limits.nodes); index >= 0) read.children.push_back(index);
  });
  // The file lists columns.
  std::array<double, 16> columns{};
  read.has_matrix = node.numbers("matrix", columns);
  for (std::size_t i = 0; i < 12; ++i) read.matrix[i] = columns[i % 4 * 4 + i / 4];
  node.numbers("translation", read.translation);
  node.numbers("rotation", read.rotation);
  node.numbers("scale", read.scale);
  read.weights = node.all_numbers("weights");
  const JsonView instances = node.at("extensions").at("EXT_mesh_gpu_instancing").at("attributes");
  read.instance_translations = instances.index("TRANSLATION", limits.accessors);
  read.instance_rotations = instances.index("ROTATION", limits.accessors);
  read.instance_scales = instances.index("SCALE", limits.accessors);
  return read;
}

/// Every node has one parent at most, and none is its own ancestor.
void link_parents(const JsonView& root, std::vector<Node>& nodes) {
  const auto fail = [&](std::size_t node, const std::string& what) {
    root.at("nodes").fail("node " + std::to_string(node) + " " + what);
  };
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    for (const int child : nodes[n].children) {
      int& parent = nodes[static_cast<std::size_t>(child)].parent;
      if (parent >= 0) return fail(static_cast<std::size_t>(child), "is a child of two nodes");
      parent = static_cast<int>(n);
    }
  }
  // From a node that is known to end at a root, all below do.
  std::vector<bool> ends(nodes.size(), false);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    std::vector<std::size_t> way;
    for (int at = static_cast<int>(n); at >= 0 && !ends[static_cast<std::size_t>(at)];
         at = nodes[static_cast<std::size_t>(at)].parent) {
      way.push_back(static_cast<std::size_t>(at));
      if (way.size() > nodes.size()) return fail(n, "is its own ancestor");
    }
    for (const std::size_t node : way) ends[node] = true;
  }
}

void parse_scene(const JsonView& root, Document& document) {
  const std::size_t num_scenes = count_of(root, "scenes");
  const int shown = std::max(root.index("scene", num_scenes), 0);
  int scene = 0;
  root.each("scenes", [&](const JsonView& given) {
    if (scene++ != shown) return;
    given.each("nodes", [&](const JsonView& node) {
      const int index = node.as_index(document.nodes.size());
      if (index < 0) return;
      if (document.nodes[static_cast<std::size_t>(index)].parent >= 0)
        document.notes.push_back(node.place() +
                                 ": a node that is another's child is shown where "
                                 "that one has it");
      document.roots.push_back(index);
    });
  });
  // Without scenes, all that is there.
  for (std::size_t n = 0; num_scenes == 0 && n < document.nodes.size(); ++n) {
    if (document.nodes[n].parent < 0) document.roots.push_back(static_cast<int>(n));
  }
}

Camera parse_camera(const JsonView& camera) {
  if (camera.text("type") == "orthographic") {
    const JsonView lens = camera.at("orthographic");
    if (!lens.has("ymag")) lens.fail("expected ymag");
    return {.perspective = false, .ymag = lens.number("ymag", 1, 1e-9, 1e9)};
  }
  if (camera.text("type") != "perspective")
    camera.fail("expected a perspective or orthographic camera");
  const JsonView lens = camera.at("perspective");
  if (!lens.has("yfov")) lens.fail("expected yfov");
  return {.perspective = true, .yfov = lens.number("yfov", 1, 1e-4, 3.14159)};
}

void parse_animation(const JsonView& animation, Document& document) {
  struct Sampler {
    int input, output;
    Interpolation interpolation;
  };
  std::vector<Sampler> samplers;
  std::set<std::string> unknown;
  const std::size_t num_accessors = document.accessors.size();
  animation.each("samplers", [&](const JsonView& sampler) {
    const std::string curve = sampler.text("interpolation");
    if (!curve.empty() && curve != "LINEAR" && curve != "STEP" && curve != "CUBICSPLINE")
      unknown.insert(curve);
    samplers.push_back({sampler.required_index("input", num_accessors),
                        sampler.required_index("output", num_accessors),
                        curve == "STEP"          ? Interpolation::step
                        : curve == "CUBICSPLINE" ? Interpolation::cubic_spline
                                                 : Interpolation::linear});
  });
  animation.each("channels", [&](const JsonView& channel) {
    const int s = channel.required_index("sampler", samplers.size());
    const JsonView target = channel.at("target");
    const int node = target.index("node", document.nodes.size());
    const std::string path = target.text("path");
    if (s < 0 || node < 0) return;  // what an extension moves
    const Sampler& sampler = samplers[static_cast<std::size_t>(s)];
    const auto add = [&](Path moved) {
      document.channels.push_back({static_cast<int>(document.animations.size()), node, moved,
                                   sampler.interpolation, sampler.input, sampler.output});
    };
    if (path == "translation") add(Path::translation);
    if (path == "rotation") add(Path::rotation);
    if (path == "scale") add(Path::scale);
    if (path == "weights") add(Path::weights);
  });
  if (!unknown.empty())
    document.notes.push_back(
        fmt::format("{}: interpolations {} are not known: they count as LINEAR", animation.place(),
                    fmt::join(unknown, ", ")));
  document.animations.push_back(animation.name("name"));
}

}  // namespace

void parse_views(const JsonView& root, Document& document) {
  root.each("bufferViews", [&](const JsonView& view) {
    document.views.push_back(parse_view(view, document.buffers.size()));
  });
}

void parse_lists(const JsonView& root, Document& document) {
  root.each("extensionsUsed",
            [&](const JsonView& name) { document.extensions_used.push_back(name.as_text()); });
  root.each("accessors", [&](const JsonView& accessor) {
    document.accessors.push_back(parse_accessor(accessor, document.views.size()));
  });
  const std::size_t num_materials = count_of(root, "materials");
  root.each("meshes", [&](const JsonView& mesh) {
    document.meshes.push_back(
        parse_mesh(mesh, document.accessors.size(), num_materials, document.notes));
  });
  root.each("cameras",
            [&](const JsonView& camera) { document.cameras.push_back(parse_camera(camera)); });
  std::size_t unturned = 0;
  const NodeLimits limits{count_of(root, "nodes"), document.meshes.size(), document.cameras.size(),
                          count_of(root, "skins"), document.accessors.size()};
  root.each("nodes", [&](const JsonView& node) {
    document.nodes.push_back(parse_node(node, limits));
    Node& read = document.nodes.back();
    unturned += read.rotation == std::array<double, 4>{} ? 1 : 0;
    fit_weights(node, read.mesh < 0 ? 0 : document.mesh_of(read).num_targets(), read.weights,
                document.notes);
  });
  if (unturned > 0)
    document.notes.push_back(
        fmt::format("{} nodes have a rotation of zeros: they are not turned", unturned));
  root.each("skins", [&](const JsonView& skin) {
    document.skins.push_back(parse_skin(skin, document.accessors.size(), limits.nodes));
  });
  link_parents(root, document.nodes);
  parse_scene(root, document);
  root.each("animations", [&](const JsonView& a) { parse_animation(a, document); });
  parse_materials(root, document);
}

}  // namespace baton::gltf
