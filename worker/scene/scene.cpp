#include "worker/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_map>

namespace baton {
namespace {

using NameIndex = std::unordered_map<std::string, std::uint32_t>;

/// Collects every fault, so that one run tells all of them.
class Faults {
 public:
  void add(const std::string& message) { text_ += (text_.empty() ? "" : "\n") + message; }
  bool any() const { return !text_.empty(); }
  Error error() const { return {ErrorKind::bad_input, text_}; }

 private:
  std::string text_;
};

/// Inverse transpose of `m` (cofactors over determinant); nullopt when `m` is singular or not
/// finite.
std::optional<Mat3> inverse_transposed(const Mat3& m) {
  const auto& a = m.m;
  const auto minor = [&a](int i, int j, int k, int l) {
    return double{a[i]} * a[j] - double{a[k]} * a[l];
  };
  const std::array<double, 9> cofactors{minor(4, 8, 5, 7), minor(5, 6, 3, 8), minor(3, 7, 4, 6),
                                        minor(2, 7, 1, 8), minor(0, 8, 2, 6), minor(1, 6, 0, 7),
                                        minor(1, 5, 2, 4), minor(2, 3, 0, 5), minor(0, 4, 1, 3)};
  const double determinant = a[0] * cofactors[0] + a[1] * cofactors[1] + a[2] * cofactors[2];
  Mat3 result;
  for (std::size_t i = 0; i < 9; ++i) {
    result.m[i] = static_cast<float>(cofactors[i] / determinant);
    if (!std::isfinite(result.m[i])) return std::nullopt;
  }
  return result;
}

/// Lowest and highest y of the mesh after `linear`.
std::pair<float, float> vertical_bounds(const TriangleMesh& mesh, const Mat3& linear) {
  float low = std::numeric_limits<float>::infinity();
  float high = -low;
  for (const Vec3& position : mesh.positions) {
    const float y = (linear * position).y;
    low = std::min(low, y);
    high = std::max(high, y);
  }
  return {low, high};
}

Mat3 scaling(const Vec3& s) { return {{s.x, 0, 0, 0, s.y, 0, 0, 0, s.z}}; }

/// The object's transform: scale, rotate about x, y, z, fit to a height, place on the ground,
/// translate.
Result<Transform> object_transform(const ObjectSpec& object, const TriangleMesh& mesh,
                                   const std::string& name) {
  Mat3 linear = rotation_about({0, 0, 1}, object.rotate_deg.z) *
                rotation_about({0, 1, 0}, object.rotate_deg.y) *
                rotation_about({1, 0, 0}, object.rotate_deg.x) * scaling(object.scale);
  if (object.fit_height) {
    const auto [low, high] = vertical_bounds(mesh, linear);
    if (!(high > low)) {
      return Error{ErrorKind::bad_input, name + ": mesh \"" + object.mesh +
                                             "\" is flat, expected a height to fit to fitHeight"};
    }
    const float factor = *object.fit_height / (high - low);
    linear = scaling({factor, factor, factor}) * linear;
  }
  Vec3 offset = object.translate;
  if (object.place_on_ground) offset.y -= vertical_bounds(mesh, linear).first;
  return Transform{linear, offset};
}

/// Two triangles, facing up.
TriangleMesh ground_mesh(const GroundSpec& ground) {
  const float h = 0.5f * ground.size;
  const float y = ground.height;
  return {.positions = {{-h, y, -h}, {-h, y, h}, {h, y, h}, {h, y, -h}},
          .normals = {},
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
Material load_material(const MaterialSpec& spec, const std::string& name, Faults& faults) {
  if (spec.kind != MaterialKind::measured) return make_material(spec);
  Result<std::shared_ptr<const MeasuredBrdf>> table = MeasuredBrdf::load(spec.file);
  if (table) return make_measured_material(std::move(*table));
  faults.add(name + ": " + table.error().message);
  return {};
}

/// Loads every mesh; a mesh that fails keeps an empty place, so that its users are not reported as
/// well.
NameIndex load_meshes(const SceneSpec& spec, Scene& scene, Faults& faults) {
  NameIndex names;
  for (const auto& [name, mesh_spec] : spec.meshes) {
    names[name] = static_cast<std::uint32_t>(scene.meshes.size());
    Result<TriangleMesh> mesh = load_mesh(mesh_spec.path, mesh_spec.smooth_normals);
    if (!mesh) faults.add("scene.meshes." + name + ": " + mesh.error().message);
    scene.meshes.push_back(mesh ? std::move(*mesh) : TriangleMesh{});
  }
  return names;
}

void place_object(const ObjectSpec& object, const std::string& name, std::uint32_t mesh,
                  std::uint32_t material, Scene& scene, Faults& faults) {
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
  scene.instances.push_back({mesh, material, *to_world, *normal_to_world});
}

}  // namespace

Result<Scene> load_scene(const JobSpec& job) {
  Scene scene;
  Faults faults;
  scene.camera = Camera(job.camera, job.image.width, job.image.height);

  // Materials and meshes, in the order of their names.
  NameIndex materials;
  for (const auto& [name, material] : job.scene.materials) {
    materials[name] = static_cast<std::uint32_t>(scene.materials.size());
    scene.materials.push_back(load_material(material, "scene.materials." + name, faults));
  }
  const NameIndex meshes = load_meshes(job.scene, scene, faults);

  // Objects, in the order of the job.
  for (std::size_t i = 0; i < job.scene.objects.size(); ++i) {
    const ObjectSpec& object = job.scene.objects[i];
    const std::string name = "scene.objects[" + std::to_string(i) + "]";
    const auto mesh = find_name(meshes, object.mesh, "mesh", name, faults);
    const auto material = find_name(materials, object.material, "material", name, faults);
    if (mesh && material) place_object(object, name, *mesh, *material, scene, faults);
  }

  // The ground comes last.
  if (job.scene.ground) {
    const auto material =
        find_name(materials, job.scene.ground->material, "material", "scene.ground", faults);
    if (material) {
      const auto mesh = static_cast<std::uint32_t>(scene.meshes.size());
      scene.meshes.push_back(ground_mesh(*job.scene.ground));
      scene.instances.push_back({mesh, *material, {}, {}});
    }
  }
  if (faults.any()) return faults.error();
  return scene;
}

}  // namespace baton
