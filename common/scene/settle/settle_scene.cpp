#include "common/scene/settle/settle_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "common/base/limits.h"
#include "common/base/suggest.h"
#include "common/job/motion.h"
#include "common/job/udim.h"
#include "common/math/inverse.h"
#include "common/scene/gltf/file_cache.h"
#include "common/scene/gltf/materials.h"
#include "common/scene/gltf/meshes.h"
#include "common/scene/gltf/names.h"
#include "common/scene/gltf/vertices.h"
#include "common/scene/settle/gltf_motion.h"

namespace baton {
namespace {

/// Names longer than this are left out of those of meshes.
constexpr std::size_t kLongestShown = 60;

/// No job has such a name by accident; people see it in warnings.
std::string mesh_name(const gltf::Document& file, int mesh, std::size_t primitive,
                      const std::optional<ShapeSpec>& shape) {
  const std::string& name = file.meshes[static_cast<std::size_t>(mesh)].name;
  return fmt::format("gltf/{}/{}{}{}{}", mesh, primitive,
                     shape ? fmt::format("/{}", shape->node) : "", name.empty() ? "" : " ",
                     name.size() <= kLongestShown ? name : "");
}

bool is_flat(const Matrix34& matrix) { return !inverse_transposed(to_transform(matrix).linear); }

/// Puts the scene of one file into a job.
class SceneTaker {
 public:
  SceneTaker(JobSpec& job, gltf::NodeMotion motion, std::vector<std::string>& left_out)
      : job_(job),
        left_out_(left_out),
        gltf_(*job.scene.gltf),
        motion_(std::move(motion)),
        file_(motion_.document()),
        material_names_(gltf::material_names(file_)),
        object_names_(gltf::object_names(file_)) {}

  Status take() {
    BATON_TRY(place_nodes());
    BATON_TRY(take_camera());
    const std::size_t num_own = job_.scene.objects.size();
    BATON_TRY(take_objects());
    if (job_.scene.objects.size() == num_own) BATON_TRY(look_for_surfaces(num_own));
    BATON_TRY(take_materials());
    if (job_.scene.materials.size() > limits::kMaxMaterials ||
        job_.scene.meshes.size() > limits::kMaxMeshes ||
        job_.scene.objects.size() > limits::kMaxObjects)
      return file_.error(fmt::format("expected at most {} materials, {} meshes and {} objects",
                                     limits::kMaxMaterials, limits::kMaxMeshes,
                                     limits::kMaxObjects));
    job_.scene.gltf.reset();
    return {};
  }

 private:
  FileClock clock() const { return {gltf_.fps, gltf_.start_frame, gltf_.animation}; }

  /// What the job says of nodes; then where all of them are in each frame.
  Status place_nodes() {
    said_.assign(file_.nodes.size(), nullptr);
    for (const auto& [name, said] : gltf_.nodes) {
      BATON_ASSIGN(const int node, motion_.find(name));
      said_[static_cast<std::size_t>(node)] = &said;
      if (!said.place) continue;
      const Vec3& t = said.place->translate;
      const Vec3& s = said.place->scale;
      const Mat3 r = rotation_about({0, 0, 1}, said.place->rotate_deg.z) *
                     rotation_about({0, 1, 0}, said.place->rotate_deg.y) *
                     rotation_about({1, 0, 0}, said.place->rotate_deg.x);
      places_.push_back({node,
                         {r.m[0] * s.x, r.m[1] * s.y, r.m[2] * s.z, t.x,  //
                          r.m[3] * s.x, r.m[4] * s.y, r.m[5] * s.z, t.y,  //
                          r.m[6] * s.x, r.m[7] * s.y, r.m[8] * s.z, t.z}});
      const gltf::Node& given = file_.nodes[static_cast<std::size_t>(node)];
      if (given.mesh >= 0 && given.skin >= 0 && given.children.empty())
        return file_.error(
            fmt::format("node \"{}\": follows its bones, expected `place` of these, or of what is "
                        "above them",
                        name));
    }
    gltf::place(places_, motion_);
    return follow_nodes();
  }

  /// Where all nodes are in the first frame, and those with meshes that move at all keys.
  Status follow_nodes() {
    for (const int node : gltf::shown_nodes(file_)) {
      const gltf::Node& given = file_.nodes[static_cast<std::size_t>(node)];
      if (motion_.moves(node) && given.mesh >= 0 && given.skin < 0)
        moved_[static_cast<std::size_t>(node)];
    }
    const auto world_at = [&](FrameNumber frame) {
      return motion_.to_world(clock().seconds_at(frame.value()));
    };
    rest_ = world_at(job_.frames.front());
    if (moved_.empty()) return {};
    keys_ = key_frames(motion_, clock(), job_.frames, limits::kMaxGltfKeys / moved_.size());
    if (moved_.size() * keys_.frames.size() > limits::kMaxGltfKeys) return too_many_keys();
    for (const FrameNumber frame : keys_.frames) {
      const std::vector<gltf::Matrix> world = world_at(frame);
      for (auto& [node, matrices] : moved_) matrices.push_back(world[node]);
    }
    return {};
  }

  Error too_many_keys() const {
    return file_.error(fmt::format("its animations give more than {} keys in the job's frames",
                                   limits::kMaxGltfKeys));
  }

  Status take_camera() {
    if (job_.camera.node.empty()) return {};
    if (job_.camera.node != kFirstCamera) {
      BATON_ASSIGN(const int node, motion_.find(job_.camera.node));
      return put_camera(motion_, node, clock(), job_.frames, job_.camera);
    }
    for (const int node : gltf::shown_nodes(file_)) {
      if (file_.nodes[static_cast<std::size_t>(node)].camera >= 0)
        return put_camera(motion_, node, clock(), job_.frames, job_.camera);
    }
    return file_.error("no camera: expected one there, or `camera` in the job");
  }

  /// Walks the scene, parents first: what is said of a node holds for those below it.
  Status take_objects() {
    struct Passed {
      bool visible = true;
      bool catcher = false;
      std::string material;
    };
    std::vector<Passed> passed(file_.nodes.size());
    for (const int n : gltf::shown_nodes(file_)) {
      const auto node = static_cast<std::size_t>(n);
      if (const int parent = file_.nodes[node].parent; parent >= 0)
        passed[node] = passed[static_cast<std::size_t>(parent)];
      if (const GltfNodeSpec* said = said_[node]) {
        passed[node].visible = passed[node].visible && said->visible;
        passed[node].catcher = passed[node].catcher || said->catcher;
        if (!said->material.empty()) passed[node].material = said->material;
      }
      if (passed[node].visible && file_.nodes[node].mesh >= 0)
        BATON_TRY(take_node(node, passed[node].material, passed[node].catcher));
    }
    return {};
  }

  /// Says why a file gives no object: an error where the job shows nothing else, either.
  Status look_for_surfaces(std::size_t num_own) {
    const std::string found = gltf::surfaceless_parts(file_);
    if (found.empty()) return {};
    if (num_own == 0 && !job_.scene.ground)
      return file_.error("nothing to show: it has " + found + " and no triangles");
    left_out_.push_back(fmt::format("{}: not shown: {}; nothing else is there", file_.path, found));
    return {};
  }

  /// What shapes the meshes of a node, if something does.
  std::optional<ShapeSpec> shape_of(std::size_t node) const {
    const auto number = static_cast<int>(node);
    const gltf::Shaping shaping = gltf::shaping_of(motion_, number);
    if (shaping == gltf::Shaping::none) return std::nullopt;
    ShapeSpec shape{.node = number, .animation = {}, .places = places_};
    if (shaping == gltf::Shaping::animated) shape.animation = clock();
    return shape;
  }

  /// Says of how many of the places of a node nothing is seen, and why.
  void leave_out(std::size_t node, std::size_t count, std::size_t all, const char* why) {
    if (count == 0) return;
    const std::string which = all == 1 ? "" : fmt::format("{} of {} instances of ", count, all);
    left_out_.push_back(fmt::format("{}: {}node \"{}\" {} {}: {} not there", file_.path, which,
                                    object_names_[node], count > 1 ? "have" : "has", why,
                                    count > 1 ? "they are" : "it is"));
  }

  /// A part without triangles is left out, and said once.
  bool makes_triangles(int mesh, std::size_t part, bool deforms) {
    const auto [found, is_new] = solid_.try_emplace({mesh, part}, true);
    if (!is_new) return found->second;
    found->second = gltf::has_triangles(
        file_, file_.meshes[static_cast<std::size_t>(mesh)].primitives[part], deforms);
    if (!found->second)
      left_out_.push_back(fmt::format("{}: {} has no triangles with area: it is not there",
                                      file_.path, gltf::place_of(mesh, part)));
    return found->second;
  }

  /// Once for each place that the node lists.
  Status take_node(std::size_t node, const std::string& material, bool catcher) {
    BATON_ASSIGN(const gltf::Instances instances, gltf::instances_of(file_, file_.nodes[node]));
    std::size_t flat = 0;
    for (const gltf::Matrix& place : instances.places) {
      BATON_ASSIGN(const bool is_there, take_node_at(node, place, material, catcher));
      flat += is_there ? 0 : 1;
    }
    const std::size_t all = instances.places.size() + instances.num_nowhere;
    leave_out(node, flat, all, "a scale of 0 in all frames");
    leave_out(node, instances.num_nowhere, all, "a place that is not finite");
    if (instances.num_unturned > 0)
      left_out_.push_back(fmt::format(
          "{}: {} of {} instances of node \"{}\" have a rotation of zeros: they are not "
          "turned",
          file_.path, instances.num_unturned, all, object_names_[node]));
    return {};
  }

  /// Whether anything is seen there: nothing is where the scale has a zero.
  Result<bool> take_node_at(std::size_t node, const gltf::Matrix& place,
                            const std::string& material, bool catcher) {
    ObjectSpec object;
    object.name = object_names_[node];
    object.catcher = catcher;
    const std::optional<ShapeSpec> shape = shape_of(node);
    if (file_.nodes[node].skin >= 0) {
      // Its bones say where it is.
    } else if (const auto moved = moved_.find(node); moved != moved_.end()) {
      std::vector<Matrix34> matrices;
      for (const gltf::Matrix& world : moved->second)
        matrices.push_back(gltf::to_floats(gltf::multiply(world, place)));
      // Which objects there are is the same for all jobs of the file.
      if (keys_.whole && std::ranges::all_of(matrices, is_flat)) return false;
      object.keys = matrix_keys(keys_.frames, matrices);
    } else {
      object.matrix = gltf::to_floats(gltf::multiply(rest_[node], place));
      if (is_flat(*object.matrix)) return false;
    }

    const int mesh = file_.nodes[node].mesh;
    const std::vector<gltf::Primitive>& primitives =
        file_.meshes[static_cast<std::size_t>(mesh)].primitives;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      if (!gltf::has_surface(primitives[p])) continue;
      if (!makes_triangles(mesh, p, shape && shape->animation)) continue;
      object.mesh = mesh_name(file_, mesh, p, shape);
      object.material = material;
      if (material.empty()) {
        object.material = material_names_[static_cast<std::size_t>(primitives[p].material + 1)];
        used_materials_.insert(primitives[p].material);
      }
      MeshSpec& spec = job_.scene.meshes[object.mesh];
      spec = {.path = gltf_.file,
              .smooth_normals = true,
              .mesh = mesh,
              .primitive = static_cast<int>(p),
              .shaped_by = shape};
      job_.scene.objects.push_back(object);
      num_keys_ += object.keys.size();
    }
    if (num_keys_ > limits::kMaxGltfKeys) return too_many_keys();
    return true;
  }

  /// All of the file, as they have numbers. What is wrong with one, and the files that its textures
  /// name, matter where something is made of it.
  Status take_materials() {
    std::set<std::string> used;
    for (const ObjectSpec& object : job_.scene.objects) used.insert(object.material);
    if (job_.scene.ground) used.insert(job_.scene.ground->material);
    for (std::size_t m = 0; m < material_names_.size(); ++m) {
      const std::string& name = material_names_[m];
      const int index = static_cast<int>(m) - 1;
      if (index < 0 && !used_materials_.contains(index)) continue;
      if (job_.scene.materials.contains(name)) continue;
      const bool is_used = used.contains(name);
      if (is_used && index >= 0 && !file_.materials[m - 1].fault.empty())
        return file_.error(fmt::format("material \"{}\": {}", name, file_.materials[m - 1].fault));
      job_.scene.materials.emplace(name, is_used ? gltf::material_spec(file_, index)
                                                 : gltf::plain_material_spec(file_, index));
    }
    return {};
  }

  JobSpec& job_;
  std::vector<std::string>& left_out_;
  const GltfSceneSpec gltf_;
  gltf::NodeMotion motion_;
  const gltf::Document& file_;
  const std::vector<std::string> material_names_;  ///< the default one, then material 0 ...
  const std::vector<std::string> object_names_;    ///< by node
  std::vector<const GltfNodeSpec*> said_;          ///< by node; null: nothing
  std::vector<PlacedNode> places_;                 ///< that the job says
  std::vector<gltf::Matrix> rest_;                 ///< by node, in the first frame
  KeyFrames keys_;                                 ///< of the nodes that move
  std::map<std::size_t, std::vector<gltf::Matrix>> moved_;  ///< by node that moves, (keys)
  std::set<int> used_materials_;
  std::map<std::pair<int, std::size_t>, bool> solid_;  ///< parts of meshes that have triangles
  std::size_t num_keys_ = 0;
};

/// Names of materials that could not be looked for before the file was read.
Status check_names(const JobSpec& job) {
  std::vector<std::string> known;
  for (const auto& item : job.scene.materials) known.push_back(item.first);
  const auto check = [&](const std::string& user, const std::string& name) -> Status {
    if (job.scene.materials.contains(name)) return {};
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: no material \"{}\"{}", user, name, suggestion(name, known))};
  };
  for (const auto& item : job.sampling.by_material)
    BATON_TRY(check("sampling.byMaterial", item.first));
  for (const ObjectSpec& object : job.scene.objects)
    BATON_TRY(check("scene, mesh \"" + object.mesh + "\"", object.material));
  if (job.scene.ground) BATON_TRY(check("scene.ground", job.scene.ground->material));
  return {};
}

/// Says what is odd about animations that shape meshes of the job. Faults are those of the meshes.
void note_shapes(const SceneSpec& scene, gltf::FileCache& cache,
                 std::vector<std::string>& left_out) {
  std::set<std::pair<std::string, std::string>> seen;
  for (const auto& [name, mesh] : scene.meshes) {
    if (!mesh.deforms()) continue;
    const std::string& animation = mesh.shaped_by->animation->animation;
    if (!seen.insert({mesh.path, animation}).second) continue;
    const auto document = cache.get(mesh.path);
    if (!document) continue;
    if (const auto motion = gltf::NodeMotion::read(*document, animation))
      add_notes(*motion, left_out);
  }
}

/// The tiles of a texture that are there.
void list_tiles(const std::string& path, std::set<std::string>& files) {
  std::error_code error;
  for (int number = kFirstTile; number < kFirstTile + kNumTiles; ++number) {
    const std::string file = tile_file(path, number);
    if (std::filesystem::exists(file, error)) files.insert(file);
  }
}

/// What glTF files refer to, and the tiles of textures, are part of the job.
Status list_files(SceneSpec& scene, gltf::FileCache& cache) {
  std::set<std::string> files;
  for (const FileSpec& file : scene.files) files.insert(file.path);
  for (const auto& [name, mesh] : scene.meshes) {
    if (!is_gltf(mesh.path)) continue;
    const auto document = cache.get(mesh.path);
    // What is wrong with a file is said where all meshes are loaded.
    if (document) files.insert((*document)->buffer_files.begin(), (*document)->buffer_files.end());
  }
  for (const auto& [name, material] : scene.materials) {
    for (const TextureSpec* texture : textures_of(material)) {
      if (has_tiles(texture->file)) list_tiles(texture->file, files);
      if (texture->image < 0) continue;
      const auto document = cache.get(texture->file);
      if (!document) continue;
      files.insert((*document)->buffer_files.begin(), (*document)->buffer_files.end());
      const auto image = static_cast<std::size_t>(texture->image);
      if (image < (*document)->images.size() && !(*document)->images[image].file.empty())
        files.insert((*document)->images[image].file);
    }
  }
  scene.files.clear();
  for (const std::string& file : files) scene.files.push_back({file});
  return {};
}

}  // namespace

Status settle_scene(JobSpec& job, std::vector<std::string>* left_out) {
  std::vector<std::string> unsaid;
  std::vector<std::string>& said = left_out == nullptr ? unsaid : *left_out;
  gltf::FileCache cache;
  note_shapes(job.scene, cache, said);
  if (job.scene.gltf) {
    BATON_ASSIGN(auto document, cache.get(job.scene.gltf->file));
    BATON_ASSIGN(gltf::NodeMotion motion,
                 gltf::NodeMotion::read(std::move(document), job.scene.gltf->animation));
    add_notes(motion, said);
    BATON_TRY(SceneTaker(job, std::move(motion), said).take());
    BATON_TRY(check_names(job));
  }
  return list_files(job.scene, cache);
}

}  // namespace baton
