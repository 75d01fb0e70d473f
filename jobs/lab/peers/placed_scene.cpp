// placed_scene JOB FOLDER [KEY=VALUE...]: what Baton sees of a job, for another renderer to show:
// meshes, and where camera, objects and map are in each frame, in Baton's axes. FOLDER/scene.json
// names the other files: meshes (floats of vertices, floats of normals where they are the file's
// own, 32-bit indices of triangles) and maps (EXR). FOLDER/job.json is the job with its defaults.
// Refuses what the renderers do not model alike.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "common/image/image_io.h"
#include "common/job/motion.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/job_json.h"
#include "common/scene/mesh/mesh_builder.h"
#include "common/scene/pose.h"
#include "common/scene/settle/settle_motion.h"
#include "worker/surface/environment.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Cycles 3.4 takes shadowing and masking of GGX as independent, Baton as correlated by height. At
/// this roughness Baton reflects .03 % more at a cosine of .35 to the viewer, .2 % at .2, 1 % at
/// .1.
constexpr float kMostRoughness = 0.3f;

Error refusal(const std::string& what) { return {ErrorKind::bad_input, what}; }

json numbers(const Vec3& v) { return {v.x, v.y, v.z}; }

/// A material that both renderers have, below its coat: Lambert's, or GGX without Fresnel's term.
Result<json> material_below(const std::string& place, const MaterialSpec& spec) {
  if (spec.kind == MaterialKind::diffuse ||
      (spec.kind == MaterialKind::metallic_roughness && spec.metallic == 0 && spec.specular == 0))
    return json{{"type", "diffuse"}, {"color", numbers(spec.base_color)}};
  if (spec.kind != MaterialKind::metallic_roughness)
    return refusal(place + ": only diffuse and metallicRoughness are compared");
  if (spec.metallic != 1 || spec.base_color != Rgb{1, 1, 1})
    return refusal(place + ": expected metallic 1 and color [1, 1, 1], where Fresnel's term is 1");
  if (spec.roughness > kMostRoughness)
    return refusal(fmt::format("{}: expected a roughness of at most {}", place, kMostRoughness));
  return json{{"type", "glossy"}, {"roughness", spec.roughness}};
}

/// The same with its coat.
Result<json> material(const std::string& name, const MaterialSpec& spec) {
  const std::string place = "scene.materials." + name;
  if (!textures_of(spec).empty() || spec.alpha_cutoff > 0 || spec.alpha_blend ||
      spec.emission != Rgb{})
    return refusal(place + ": textures, holes and emission are not compared");
  BATON_ASSIGN(json entry, material_below(place, spec));
  if (spec.clearcoat.value_or(0) == 0) return entry;
  const float roughness = spec.clearcoat_roughness.value_or(kLeastRoughness);
  if (roughness > kMostRoughness)
    return refusal(
        fmt::format("{}: expected a clearcoatRoughness of at most {}", place, kMostRoughness));
  entry["coat"] = {{"weight", *spec.clearcoat}, {"roughness", roughness}};
  return entry;
}

Result<json> materials(const SceneSpec& scene) {
  json list = json::array();
  for (const auto& [name, spec] : scene.materials) {
    BATON_ASSIGN(json entry, material(name, spec));
    list.push_back(std::move(entry));
  }
  return list;
}

template <class T>
void append(std::ofstream& file, const std::vector<T>& values) {
  file.write(reinterpret_cast<const char*>(values.data()),
             static_cast<std::streamsize>(values.size() * sizeof(T)));
}

/// Which normals a mesh has: those of its triangles, those that follow from them, or others.
std::string kind_of_normals(const TriangleMesh& mesh) {
  if (mesh.normals.empty()) return "flat";
  return mesh.normals == smooth_vertex_normals(mesh.positions, mesh.triangles) ? "smooth" : "own";
}

Result<json> write_mesh(const TriangleMesh& mesh, const fs::path& folder, const std::string& name) {
  const std::string normals = kind_of_normals(mesh);
  std::ofstream file(folder / name, std::ios::binary);
  append(file, mesh.positions);
  if (normals == "own") append(file, mesh.normals);
  append(file, mesh.triangles);
  if (!file.flush()) return Error{ErrorKind::io, (folder / name).string() + ": cannot write"};
  return json{{"file", name},
              {"vertices", mesh.positions.size()},
              {"triangles", mesh.triangles.size()},
              {"normals", normals}};
}

/// The texels of the maps of all frames, each written once.
class MapWriter {
 public:
  MapWriter(const EnvironmentSpec& environment, fs::path folder)
      : environment_(environment), folder_(std::move(folder)) {}

  /// Index of the map that a frame shows.
  Result<std::size_t> index_of(const EnvironmentFrame& frame) {
    const std::tuple key(frame.map_a, frame.map_b, frame.mix, frame.scale);
    if (const auto found = written_.find(key); found != written_.end()) return found->second;
    BATON_ASSIGN(const EnvironmentMap a, key_map(frame.map_a));
    if (frame.mix > 0) {
      BATON_ASSIGN(const EnvironmentMap b, key_map(frame.map_b));
      if (a.width() != b.width() || a.height() != b.height())
        return refusal("environment: maps of different sizes");
      BATON_TRY(write(EnvironmentMap(a, b, frame.mix, frame.scale, false)));
    } else {
      BATON_TRY(write(EnvironmentMap(a, a, 0, frame.scale, false)));
    }
    return written_[key] = files_.size() - 1;
  }
  const std::vector<std::string>& files() const { return files_; }

 private:
  Result<EnvironmentMap> key_map(std::int32_t key) const {
    BATON_ASSIGN(const RgbImage image,
                 read_rgb_image(environment_.keys[static_cast<std::size_t>(key)].map));
    return make_map(image, environment_, false);
  }

  Status write(const EnvironmentMap& map) {
    FilmTile image{{0, 0, map.width(), map.height()}, {"B", "G", "R"}, {}};
    image.values.resize(3 * image.num_pixels());
    float* out = image.values.data();
    for (const auto channel :
         {&EnvironmentMap::Texel::b, &EnvironmentMap::Texel::g, &EnvironmentMap::Texel::r}) {
      for (int j = 0; j < map.height(); ++j) {
        const EnvironmentMap::Texel* row = map.texels() + (j + 1) * map.stride() + 1;
        for (int i = 0; i < map.width(); ++i) *out++ = row[i].*channel;
      }
    }
    files_.push_back(fmt::format("map-{}.exr", files_.size()));
    return write_exr(folder_ / files_.back(), image,
                     {.half_float = false, .compression = "none", .metadata = {}});
  }

  const EnvironmentSpec& environment_;
  fs::path folder_;
  std::map<std::tuple<std::int32_t, std::int32_t, float, float>, std::size_t> written_;
  std::vector<std::string> files_;
};

/// Axes of the camera in the world (x to the right, y up, looking along -z) and its angle of view.
json camera(const JobSpec& job, const Camera& camera, FrameNumber frame) {
  const CameraSpec spec = camera_at(job, frame.value());
  const Matrix4 m = camera.world_to_camera();
  const auto axis = [&m](std::size_t c) { return json{m[c], m[4 + c], m[8 + c]}; };
  return {{"position", numbers(spec.position)},
          {"right", axis(0)},
          {"up", axis(1)},
          {"back", axis(2)},
          {"verticalFovDeg", spec.vertical_fov_deg}};
}

/// Three rows of four numbers.
json matrix(const Transform& t) {
  const auto& m = t.linear.m;
  return {m[0], m[1], m[2], t.offset.x, m[3], m[4], m[5], t.offset.y, m[6], m[7], m[8], t.offset.z};
}

Result<json> frame(const JobSpec& job, const Scene& scene, const FrameSpec& spec, MapWriter& maps) {
  const Pose pose = pose_at(scene, job, spec.number.value());
  json placed = json::array();
  for (const Instance& instance : pose.instances) placed.push_back(matrix(instance.to_world));
  BATON_ASSIGN(const std::size_t map, maps.index_of(spec.environment));
  return json{{"number", spec.number.value()},
              {"camera", camera(job, pose.camera, spec.number)},
              {"instances", std::move(placed)},
              {"map", map},
              {"rotation", spec.environment.rotation.m}};
}

Status place(const std::string& job_file, const fs::path& folder,
             const std::vector<JobOverride>& overrides) {
  BATON_ASSIGN(JobSpec written, load_job(job_file, overrides));
  BATON_ASSIGN(const JobSpec job, settle_motion(std::move(written)));
  if (job.image.region || job.image.filter != PixelFilter::box)
    return refusal("image: only whole pictures with the box filter are compared");
  const CameraSpec& camera = job.camera;
  if (camera.projection != Projection::perspective || camera.shift != std::array<float, 2>{} ||
      camera.aperture > 0)
    return refusal("camera: only pinholes without shift are compared");
  if (has_catcher(job)) return refusal(catcher_key(job) + ": catchers are not compared");
  BATON_ASSIGN(json shown_materials, materials(job.scene));
  BATON_ASSIGN(const Scene scene, load_scene(job));
  std::error_code error;
  fs::create_directories(folder, error);

  json meshes = json::array(), instances = json::array(), frames = json::array();
  for (const TriangleMesh& mesh : scene.meshes) {
    BATON_ASSIGN(json entry, write_mesh(mesh, folder, fmt::format("mesh-{}.bin", meshes.size())));
    meshes.push_back(std::move(entry));
  }
  for (const Instance& instance : scene.instances)
    instances.push_back({{"mesh", instance.mesh}, {"material", instance.material}});
  MapWriter maps(job.environment, folder);
  const Timeline timeline(job);
  for (const FrameSpec& spec : expand_sequence(job)) {
    BATON_ASSIGN(json entry, frame(job, scene, spec, maps));
    entry["file"] = frame_path(job, timeline.frame_of(spec.step)).filename().string();
    frames.push_back(std::move(entry));
  }

  std::ofstream(folder / "job.json") << to_json(job) << '\n';
  std::ofstream(folder / "scene.json")
      << json{{"name", job.name},
              {"width", job.image.width},
              {"bounces", job.light.bounces},
              {"height", job.image.height},
              {"bilinear", job.environment.filter == MapFilter::bilinear},
              {"moves", moves(job)},
              {"materials", std::move(shown_materials)},
              {"meshes", std::move(meshes)},
              {"instances", std::move(instances)},
              {"maps", maps.files()},
              {"frames", std::move(frames)}}
             .dump(1)
      << '\n';
  return {};
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  if (argc < 3) return 64;
  std::vector<baton::JobOverride> overrides;
  for (int i = 3; i < argc; ++i) {
    const std::string setting = argv[i];
    const std::size_t equals = std::min(setting.find('='), setting.size() - 1);
    overrides.push_back({setting.substr(0, equals), setting.substr(equals + 1)});
  }
  const baton::Status status = baton::place(argv[1], argv[2], overrides);
  if (status) return 0;
  fmt::print(stderr, "{}\n", status.error().message);
  return 65;
}
