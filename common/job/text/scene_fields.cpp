#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/base/suggest.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/job_fields.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// A name that must be a key of `named`; a required one unless `key` says otherwise.
template <class T>
void reference(JobArchive& a, Key key, std::string& name, const std::map<std::string, T>& named,
               const char* what) {
  if (!a.text(key, name) || named.contains(name)) return;
  std::vector<std::string> known;
  if (a.explains_faults()) {
    for (const auto& item : named) known.push_back(item.first);
  }
  a.fault(key.name, fmt::format("the name of a {}", what),
          fmt::format("\"{}\"{}", name, suggestion(name, known)));
}

/// The name of a material. Those of a glTF file are not known yet: they are checked when the scene
/// is loaded.
void material_reference(JobArchive& a, Key key, std::string& name, const SceneSpec& scene) {
  if (scene.gltf) {
    a.text(key, name);
  } else {
    reference(a, key, name, scene.materials, "material");
  }
}

void fields(JobArchive& a, ShapeSpec& shape) {
  a.integer(required("node"), shape.node, 0, limits::kMaxGltfIndex);
  FileClock clock = shape.animation.value_or(FileClock{});
  const auto visit = [&] {
    a.number("fps", clock.fps, kPositiveRange);
    a.integer("startFrame", clock.start_frame, 0, limits::kMaxFrameNumber);
    a.text(alternative("name"), clock.animation);
  };
  if (a.object("animation", visit, {.present = shape.animation.has_value()}))
    shape.animation = clock;
  a.list("places", shape.places, limits::kMaxObjects, [&](PlacedNode& placed) {
    a.integer(required("node"), placed.node, 0, limits::kMaxGltfIndex);
    std::optional<Matrix34> matrix = placed.matrix;
    matrix_field(a, required("matrix"), matrix);
    placed.matrix = matrix.value_or(Matrix34{});
  });
}

void fields(JobArchive& a, MeshSpec& mesh) {
  asset_path(a, required("path"), mesh.path, {".ply", ".obj", ".off", ".gltf", ".glb"});
  a.boolean("smoothNormals", mesh.smooth_normals);
  a.integer("mesh", mesh.mesh, -1, limits::kMaxGltfIndex);
  a.integer("primitive", mesh.primitive, 0, limits::kMaxGltfIndex);
  if (mesh.mesh >= 0 && !is_gltf(mesh.path))
    a.fault("mesh", "-1 unless path is a .gltf or .glb file", std::to_string(mesh.mesh));
  ShapeSpec shape = mesh.shaped_by.value_or(ShapeSpec{});
  if (a.object("shapedBy", [&] { fields(a, shape); }, {.present = mesh.shaped_by.has_value()})) {
    mesh.shaped_by = shape;
    if (mesh.mesh < 0) a.fault("shapedBy", "a mesh of a glTF file", "mesh -1");
  }
}

void fields(JobArchive& a, ObjectSpec& object, const SceneSpec& scene) {
  reference(a, required("mesh"), object.mesh, scene.meshes, "mesh");
  material_reference(a, required("material"), object.material, scene);
  a.text(alternative("name"), object.name);
  a.vector("translate", object.translate, kCoordinateRange);
  a.vector("rotateDeg", object.rotate_deg, kAngleRange);
  a.vector("scale", object.scale, kPositiveRange, true);
  a.choice("upAxis", object.up_axis, kUpAxes);
  a.number("fitHeight", object.fit_height, kPositiveRange);
  a.boolean("center", object.center);
  a.boolean("placeOnGround", object.place_on_ground);
  a.flag("catcher", object.catcher);
  matrix_field(a, "matrix", object.matrix);
  motion_fields(a, object);
}

void fields(JobArchive& a, GroundSpec& ground, const SceneSpec& scene) {
  material_reference(a, required("material"), ground.material, scene);
  a.number("height", ground.height, kCoordinateRange);
  a.number("size", ground.size, kPositiveRange);
  a.boolean("catcher", ground.catcher);
}

void fields(JobArchive& a, GltfNodeSpec& node) {
  a.boolean("visible", node.visible);
  a.text(alternative("material"), node.material);
  a.flag("catcher", node.catcher);
  PlaceSpec place = node.place.value_or(PlaceSpec{});
  const auto visit = [&] {
    a.vector("translate", place.translate, kCoordinateRange);
    a.vector("rotateDeg", place.rotate_deg, kAngleRange);
    a.vector("scale", place.scale, kPositiveRange, true);
  };
  if (a.object("place", visit, {.present = node.place.has_value()})) node.place = place;
}

void fields(JobArchive& a, GltfSceneSpec& gltf) {
  asset_path(a, required("file"), gltf.file, {".gltf", ".glb"});
  a.number("fps", gltf.fps, kPositiveRange);
  a.integer("startFrame", gltf.start_frame, 0, limits::kMaxFrameNumber);
  a.text(alternative("animation"), gltf.animation);
  a.named("nodes", gltf.nodes, limits::kMaxObjects, [&](GltfNodeSpec& node) { fields(a, node); });
}

void fields(JobArchive& a, EnvironmentKey& key) {
  a.number(required("frame"), key.frame, {0, limits::kMaxFrameNumber});
  asset_path(a, required("map"), key.map, {".exr", ".hdr"});
}

/// One key per frame of the job.
void expand_numbered(const FileSequence& numbered, const std::vector<FrameNumber>& frames,
                     std::vector<EnvironmentKey>& keys) {
  keys.clear();
  for (const FrameNumber frame : frames)
    keys.push_back({static_cast<double>(frame.value()), file_at(numbered, frame)});
}

/// Numbers at ascending frames; `name`: the key of the number.
void number_keys(JobArchive& a, const char* list, std::vector<NumberKey>& keys, const char* name,
                 NumberRange range) {
  a.list(list, keys, limits::kMaxFrames, [&](NumberKey& key) {
    a.number(required("frame"), key.frame, kFrameRange);
    a.number(required(name), key.value, range);
  });
  check_ascending(a, list, keys);
}

}  // namespace

void matrix_field(JobArchive& a, Key key, std::optional<Matrix34>& matrix) {
  std::array<double, 12> rows;
  rows.fill(std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; matrix && i < rows.size(); ++i) rows[i] = decimal((*matrix)[i]);
  if (!a.numbers(key, rows, kCoordinateRange, false)) return;
  matrix.emplace();
  for (std::size_t i = 0; i < rows.size(); ++i) (*matrix)[i] = static_cast<float>(rows[i]);
}

bool is_gltf(const std::string& path) {
  const std::string extension = lower_extension(path);
  return extension == ".gltf" || extension == ".glb";
}

void asset_path(JobArchive& a, Key key, std::string& path,
                std::initializer_list<std::string_view> extensions) {
  if (!a.path(key, path)) return;
  const std::string extension = lower_extension(path);
  if (std::find(extensions.begin(), extensions.end(), extension) != extensions.end()) return;

  std::string expected = "a file name that ends in";
  for (const std::string_view e : extensions) expected += fmt::format(" {}", e);
  a.fault(key.name, expected, fmt::format("\"{}\"", fs::path(path).filename().string()));
}

void fields(JobArchive& a, FileSequence& sequence,
            std::initializer_list<std::string_view> extensions) {
  asset_path(a, required("files"), sequence.files, extensions);
  a.number("speed", sequence.speed, {-1e6, 1e6});
  a.integer("offset", sequence.offset, -limits::kMaxFrameNumber, limits::kMaxFrameNumber);
  a.integer("first", sequence.first, 0, limits::kMaxFrameNumber);
  a.integer("last", sequence.last, 0, limits::kMaxFrameNumber);
  if (sequence.last < sequence.first)
    a.fault("last", fmt::format("at least first, {}", sequence.first),
            std::to_string(sequence.last));
  a.choice("beyond", sequence.beyond, kFilesBeyond);
  if (sequence.beyond == FilesBeyond::loop && sequence.last == limits::kMaxFrameNumber)
    a.fault("last", "the number after which files begin anew, as beyond is loop", "none");
}

void fields(JobArchive& a, SceneSpec& scene) {
  GltfSceneSpec gltf = scene.gltf.value_or(GltfSceneSpec{});
  if (a.object("gltf", [&] { fields(a, gltf); },
               {.shorthand = "file", .present = scene.gltf.has_value()})) {
    scene.gltf = gltf;
  }
  a.named("materials", scene.materials, limits::kMaxMaterials,
          [&](MaterialSpec& item) { fields(a, item); });
  a.named("meshes", scene.meshes, limits::kMaxMeshes, [&](MeshSpec& item) { fields(a, item); },
          {.shorthand = "path"});
  a.list("objects", scene.objects, limits::kMaxObjects,
         [&](ObjectSpec& item) { fields(a, item, scene); });
  GroundSpec ground = scene.ground.value_or(GroundSpec{});
  if (a.object("ground", [&] { fields(a, ground, scene); },
               {.present = scene.ground.has_value()})) {
    scene.ground = ground;
  }
  a.list("files", scene.files, limits::kMaxMeshes,
         [&](FileSpec& file) { a.path(required("path"), file.path); });
}

void fields(JobArchive& a, EnvironmentSpec& environment, const std::vector<FrameNumber>& frames) {
  std::vector<EnvironmentKey>& keys = environment.keys;
  int forms = 0;

  // One map for all frames.
  std::string map;
  asset_path(a, alternative("map"), map, {".exr", ".hdr"});
  if (!map.empty()) {
    keys = {{1, map}};
    ++forms;
  }

  // Numbered maps.
  FileSequence numbered;
  a.object(alternative("frames"),
           [&] {
             fields(a, numbered, {".exr", ".hdr"});
             if (!numbered.files.empty() && !numbered.is_numbered())
               a.fault("files", "a numbered file name such as sky.####.exr",
                       fmt::format("\"{}\"", fs::path(numbered.files).filename().string()));
           },
           {.shorthand = "files", .present = false});
  if (!numbered.files.empty()) {
    expand_numbered(numbered, frames, keys);
    environment.interpolate = false;
    ++forms;
  }

  // Maps at key frames: the form that is written.
  const int max_keys = limits::kMaxFrames;
  forms += a.list(alternative("keys"), keys, max_keys, [&](EnvironmentKey& key) { fields(a, key); })
               ? 1
               : 0;
  if (forms != 1 || keys.empty()) {
    a.fault("", "exactly one of map, keys (at least one) and frames",
            forms > 1 ? "several" : "none");
  }
  check_ascending(a, "keys", keys);

  a.boolean("interpolate", environment.interpolate);
  a.choice("filter", environment.filter, kMapFilters);
  a.number("scale", environment.scale, kFactorRange);
  number_keys(a, "scaleKeys", environment.scale_keys, "scale", kFactorRange);
  a.integer("maxWidth", environment.max_width, 0, limits::kMaxEnvironmentSide);
  a.object("rotation", [&] {
    a.vector("axis", environment.rotation_axis, kCoordinateRange);
    if (length(environment.rotation_axis) == 0) a.fault("axis", "a direction", "[0, 0, 0]");
    a.integer("startFrame", environment.rotation_start_frame, 0, limits::kMaxFrameNumber);
    a.number("startDeg", environment.rotation_start_deg, kAngleRange);
    a.number("degPerFrame", environment.rotation_deg_per_frame, kAngleRange);
    number_keys(a, "keys", environment.rotation_keys, "deg", kAngleRange);
    const bool turns =
        environment.rotation_start_deg != 0 || environment.rotation_deg_per_frame != 0;
    if (!environment.rotation_keys.empty() && turns)
      a.fault("keys", "either keys or startDeg and degPerFrame", "both");
  });
  CameraMapSpec& camera_map = environment.camera_map;
  a.object("cameraMap",
           [&] {
             asset_path(a, required("file"), camera_map.file, {".exr", ".hdr"});
             a.number("scale", camera_map.scale, kPositiveRange);
           },
           {.shorthand = "file", .present = !camera_map.file.empty()});
}

}  // namespace baton
