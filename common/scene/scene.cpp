#include "common/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <type_traits>
#include <unordered_map>

#include "common/job/motion.h"
#include "common/math/bounds.h"
#include "common/math/inverse.h"
#include "common/scene/gltf/meshes.h"
#include "common/scene/material/detail_loader.h"
#include "common/scene/material/surface_detail.h"
#include "common/scene/mesh/tangents.h"
#include "common/scene/mesh_loader.h"

namespace baton {
namespace {

using NameIndex = std::unordered_map<std::string, std::uint32_t>;

/// Collects every fault, so that one run tells all of them.
class Faults {
 public:
  void add(const std::string& message) { add(message, ErrorKind::bad_input); }
  /// Of `place`.
  void add(const std::string& place, const Error& error) {
    add(place + ": " + error.message, error.kind);
  }
  bool any() const { return !text_.empty(); }
  Error error() const { return {kind_, text_}; }

 private:
  /// Looking again helps where all files could but not be read.
  void add(const std::string& message, ErrorKind kind) {
    if (text_.empty() || kind != ErrorKind::io) kind_ = kind;
    text_ += (text_.empty() ? "" : "\n") + message;
  }

  ErrorKind kind_ = ErrorKind::bad_input;
  std::string text_;
};

/// The box around the mesh after `map`.
Bounds bounds_of(const TriangleMesh& mesh, const Transform& map) {
  Bounds bounds;
  for (const Vec3& position : mesh.positions) bounds.add(map.point(position));
  return bounds;
}

/// Turns this axis of a mesh to y.
Mat3 upright(UpAxis up) {
  switch (up) {
    case UpAxis::x:
      return {{0, -1, 0, 1, 0, 0, 0, 0, 1}};
    case UpAxis::y:
      break;
    case UpAxis::z:
      return {{1, 0, 0, 0, 0, 1, 0, -1, 0}};
  }
  return {{1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

Mat3 scaling(const Vec3& s) { return {{s.x, 0, 0, 0, s.y, 0, 0, 0, s.z}}; }

Transform scaled(const Transform& map, float factor) {
  return {scaling({factor, factor, factor}) * map.linear, map.offset * factor};
}

/// In doubles: far from the origin floats are coarse.
Position turned_by(const Mat3& m, const Position& p) {
  Position turned{};
  for (std::size_t i = 0; i < 3; ++i)
    turned[i] = m.m[3 * i] * p[0] + m.m[3 * i + 1] * p[1] + m.m[3 * i + 2] * p[2];
  return turned;
}

/// The object's transform: its matrix, stand up, scale, rotate about x, y, z, fit to a height,
/// centre, place on the ground, translate.
Result<Transform> object_transform(const ObjectSpec& object, const TriangleMesh& mesh,
                                   const std::string& name) {
  const Mat3 turned = rotation_about({0, 0, 1}, object.rotate_deg.z) *
                      rotation_about({0, 1, 0}, object.rotate_deg.y) *
                      rotation_about({1, 0, 0}, object.rotate_deg.x) * scaling(object.scale) *
                      upright(object.up_axis);
  Transform map{turned, {}};
  if (object.matrix) {
    const Transform given = to_transform(*object.matrix);
    map = {turned * given.linear, turned * given.offset};
  }
  if (object.fit_height) {
    const auto [low, high] = bounds_of(mesh, map);
    if (!(high.y > low.y)) {
      return Error{ErrorKind::bad_input, name + ": mesh \"" + object.mesh +
                                             "\" is flat, expected a height to fit to fitHeight"};
    }
    map = scaled(map, *object.fit_height / (high.y - low.y));
  }
  // Positions count from the origin of their own that a mesh may have.
  Position offset = turned_by(map.linear, mesh.origin);
  if (object.place_on_ground || object.center) {
    const auto [low, high] = bounds_of(mesh, map);
    if (object.place_on_ground) {
      map.offset.y -= low.y;
      offset[1] = 0;
    }
    if (object.center) {
      map.offset = map.offset - Vec3{low.x + high.x, 0, low.z + high.z} * 0.5f;
      offset[0] = offset[2] = 0;
    }
  }
  map.offset += object.translate;
  if (offset != Position{}) {
    const Vec3& o = map.offset;
    map.offset = {static_cast<float>(o.x + offset[0]), static_cast<float>(o.y + offset[1]),
                  static_cast<float>(o.z + offset[2])};
  }
  return map;
}

/// Two triangles, facing up. Texture coordinates are x and z: an image is one unit wide.
TriangleMesh ground_mesh(const GroundSpec& ground) {
  const float h = 0.5f * ground.size;
  const float y = ground.height;
  return {.positions = {{-h, y, -h}, {-h, y, h}, {h, y, h}, {h, y, -h}},
          .normals = {},
          .uvs = {{{{-h, -h}, {-h, h}, {h, h}, {h, -h}}, {}}},
          .triangles = {{0, 1, 2}, {0, 2, 3}}};
}

/// Index of `name`; a name that is not there is a fault of `user`.
std::optional<std::uint32_t> find_name(const NameIndex& names, const std::string& name,
                                       const char* kind, const std::string& user, Faults& faults) {
  if (const auto found = names.find(name); found != names.end()) return found->second;
  faults.add(user + ": unknown " + kind + " \"" + name + "\"");
  return std::nullopt;
}

/// A material that fails keeps its place.
Material load_material(const MaterialSpec& spec, const std::string& name, DetailLoader& details,
                       Faults& faults) {
  if (spec.kind != MaterialKind::measured) {
    Material material = make_material(spec);
    auto detail = details.load(spec);
    if (detail) {
      material.detail = std::move(*detail);
    } else {
      faults.add(name, detail.error());
    }
    return material;
  }
  Result<std::shared_ptr<const MeasuredBrdf>> table = MeasuredBrdf::load(spec.file);
  if (table) return make_measured_material(std::move(*table));
  faults.add(name, table.error());
  return {};
}

/// Names of meshes that a texture lies on.
std::set<std::string> textured_meshes(const SceneSpec& spec) {
  std::set<std::string> names;
  for (const ObjectSpec& object : spec.objects) {
    const auto material = spec.materials.find(object.material);
    if (material != spec.materials.end() && !textures_of(material->second).empty())
      names.insert(object.mesh);
  }
  return names;
}

Result<TriangleMesh> load_part(const MeshSpec& spec, bool with_uvs, gltf::FileCache& files,
                               gltf::MotionCache& motions) {
  if (spec.mesh < 0) return load_mesh(spec.path, spec.smooth_normals, with_uvs, files.listed());
  BATON_ASSIGN(const auto document, files.get(spec.path));
  if (!spec.shaped_by) return gltf::primitive_mesh(*document, spec);
  BATON_ASSIGN(auto motion, motions.get(document, *spec.shaped_by));
  return gltf::shaped_mesh(*document, std::move(motion), spec);
}

/// Whether the mesh has the texture coordinates that the material's textures need; makes tangents
/// where it has a normal map.
void fit_mesh(const Material& material, const std::string& material_name,
              const std::string& mesh_name, const std::string& user, TriangleMesh& mesh,
              Faults& faults) {
  if (material.detail == nullptr || mesh.positions.empty()) return;
  if (const auto missing = missing_uvs(*material.detail, mesh)) {
    faults.add(
        fmt::format("{}: {} has no texture coordinates of set {}, which {} of material "
                    "\"{}\" needs",
                    user, mesh_name, missing->set, missing->texture, material_name));
    return;
  }
  if (const auto missing = missing_tiles(*material.detail, mesh)) {
    faults.add(
        fmt::format("{}: {}: material \"{}\": {}", user, mesh_name, material_name, *missing));
    return;
  }
  for (const DetailImage map : {DetailImage::normal, DetailImage::clearcoat_normal}) {
    if (material.detail->has(map)) derive_tangents(mesh, (*material.detail)[map].uv_set);
  }
}

/// Loads every mesh; a mesh that fails keeps an empty place, so that its users are not reported as
/// well.
NameIndex load_meshes(const SceneSpec& spec, gltf::FileCache& files, Scene& scene, Faults& faults) {
  NameIndex names;
  gltf::MotionCache motions;
  const std::set<std::string> textured = textured_meshes(spec);
  for (const auto& [name, mesh_spec] : spec.meshes) {
    names[name] = static_cast<std::uint32_t>(scene.meshes.size());
    Result<TriangleMesh> mesh = load_part(mesh_spec, textured.contains(name), files, motions);
    if (!mesh) faults.add("scene.meshes." + name, mesh.error());
    scene.meshes.push_back(mesh ? std::move(*mesh) : TriangleMesh{});
  }
  return names;
}

/// Colours of vertices are looked up where textures are.
void add_detail(const MaterialSpec& spec, Material& material, Scene& scene) {
  if (material.detail != nullptr || spec.kind == MaterialKind::measured) return;
  auto detail = std::make_shared<SurfaceDetail>();
  detail->spec = spec;
  material.detail = std::move(detail);
  scene.has_detail = true;
}

void place_object(const ObjectSpec& object, std::size_t index, const std::string& name,
                  std::uint32_t mesh, std::uint32_t material, Scene& scene, Faults& faults) {
  if (scene.meshes[mesh].positions.empty()) return;  // its own fault is known
  const Result<Transform> to_world = object_transform(object, scene.meshes[mesh], name);
  if (!to_world) {
    faults.add(to_world.error().message);
    return;
  }
  const std::optional<Mat3> normal_to_world = inverse_transposed(to_world->linear);
  if (!normal_to_world) {
    faults.add(name + ": expected a finite scale without zeros");
    return;
  }
  const std::int32_t moving_object = moves(object) ? static_cast<std::int32_t>(index) : -1;
  scene.instances.push_back({.mesh = mesh,
                             .material = material,
                             .to_world = *to_world,
                             .normal_to_world = *normal_to_world,
                             .moving_object = moving_object,
                             .is_catcher = object.catcher,
                             .deforms = scene.meshes[mesh].deformation != nullptr});
}

}  // namespace

std::uint64_t Scene::size_bytes() const {
  std::uint64_t size = 0;
  const auto add = [&size](const auto& array) {
    size += array.capacity() * sizeof(typename std::decay_t<decltype(array)>::value_type);
  };
  for (const TriangleMesh& mesh : meshes) {
    add(mesh.positions);
    add(mesh.normals);
    for (const auto& uvs : mesh.uvs) add(uvs);
    add(mesh.tangents);
    add(mesh.colors);
    add(mesh.triangles);
    if (mesh.deformation != nullptr) size += mesh.deformation->size_bytes();
  }
  std::set<const Texture*> textures;  // materials share them
  for (const Material& material : materials) {
    if (material.detail == nullptr) continue;
    const SurfaceDetail& detail = *material.detail;
    for (const auto& [name, placed] : detail.textures()) {
      textures.insert(placed->texture.get());
      if (placed->tiles == nullptr) continue;
      for (const auto& image : placed->tiles->images) textures.insert(image.get());
    }
  }
  textures.erase(nullptr);
  for (const Texture* const texture : textures) size += texture->size_bytes();
  return size;
}

MeshVertices vertices_of(const Scene& scene, const MeshShapes& shapes, std::uint32_t mesh) {
  if (mesh < shapes.size() && shapes[mesh] != nullptr) {
    const MeshShape& shape = *shapes[mesh];
    return {shape.positions, shape.normals, shape.tangents};
  }
  const TriangleMesh& rest = scene.meshes[mesh];
  return {rest.positions, rest.normals, rest.tangents};
}

Result<Scene> load_scene(const JobSpec& job, FilesBeside beside, std::uint64_t max_texture_bytes) {
  Scene scene;
  Faults faults;

  // Materials and meshes, in the order of their names.
  std::optional<std::set<std::string>> listed;
  if (beside == FilesBeside::listed) {
    listed.emplace();
    for (const FileSpec& file : job.scene.files) listed->insert(file.path);
  }
  gltf::FileCache files(std::move(listed));
  DetailLoader details(files, job.scene.files, max_texture_bytes);
  NameIndex materials;
  std::vector<const MaterialSpec*> material_specs;
  for (const auto& [name, material] : job.scene.materials) {
    material_specs.push_back(&material);
    materials[name] = static_cast<std::uint32_t>(scene.materials.size());
    scene.materials.push_back(load_material(material, "scene.materials." + name, details, faults));
    scene.has_detail = scene.has_detail || scene.materials.back().detail != nullptr;
  }
  const NameIndex meshes = load_meshes(job.scene, files, scene, faults);

  // Objects, in the order of the job.
  std::set<std::pair<std::uint32_t, std::uint32_t>> fitted;
  for (std::size_t i = 0; i < job.scene.objects.size(); ++i) {
    const ObjectSpec& object = job.scene.objects[i];
    const std::string name = "scene.objects[" + std::to_string(i) + "]";
    const auto mesh = find_name(meshes, object.mesh, "mesh", name, faults);
    const auto material = find_name(materials, object.material, "material", name, faults);
    if (!mesh || !material) continue;
    place_object(object, i, name, *mesh, *material, scene, faults);
    if (!scene.meshes[*mesh].colors.empty())
      add_detail(*material_specs[*material], scene.materials[*material], scene);
    if (!fitted.insert({*mesh, *material}).second) continue;
    fit_mesh(scene.materials[*material], object.material,
             job.scene.meshes.at(object.mesh).path + ", mesh \"" + object.mesh + "\"", name,
             scene.meshes[*mesh], faults);
  }

  // The ground comes last.
  if (job.scene.ground) {
    const auto material =
        find_name(materials, job.scene.ground->material, "material", "scene.ground", faults);
    if (material) {
      const auto mesh = static_cast<std::uint32_t>(scene.meshes.size());
      scene.meshes.push_back(ground_mesh(*job.scene.ground));
      scene.instances.push_back({mesh, *material, {}, {}, -1, job.scene.ground->catcher});
      fit_mesh(scene.materials[*material], job.scene.ground->material, "the ground", "scene.ground",
               scene.meshes[mesh], faults);
    }
  }
  if (faults.any()) return faults.error();
  scene.has_catcher = std::ranges::any_of(scene.instances, &Instance::is_catcher);
  return scene;
}

}  // namespace baton
