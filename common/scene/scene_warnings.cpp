#include "common/scene/scene_warnings.h"

#include <fmt/format.h>

#include <set>

#include "common/base/suggest.h"
#include "common/scene/gltf/document.h"
#include "common/scene/gltf/materials.h"
#include "common/scene/gltf/vertices.h"

namespace baton {
namespace {

/// Names of materials that something is made of.
std::set<std::string> used_materials(const SceneSpec& scene) {
  std::set<std::string> used;
  for (const ObjectSpec& object : scene.objects) used.insert(object.material);
  if (scene.ground) used.insert(scene.ground->material);
  return used;
}

/// Where a material is that of the file, and not one that the job has in its place.
void warn_of_materials(const gltf::Document& file, const SceneSpec& scene,
                       const std::set<std::string>& used, std::vector<std::string>& warnings) {
  const std::vector<std::string> names = gltf::material_names(file);
  for (std::size_t m = 0; m < file.materials.size(); ++m) {
    const std::string& name = names[m + 1];
    const auto taken = scene.materials.find(name);
    if (taken == scene.materials.end() || !used.contains(name) ||
        taken->second != gltf::material_spec(file, static_cast<int>(m)))
      continue;
    for (const std::string& what : gltf::unsupported_parts(file, file.materials[m]))
      warnings.push_back(fmt::format("{}: material \"{}\": {}", file.path, name, what));
  }
}

void warn_of_file(const gltf::Document& file, std::vector<std::string>& warnings) {
  const auto add = [&](const std::string& what) { warnings.push_back(file.path + ": " + what); };
  for (const std::string& extension : file.extensions_used) {
    if (!gltf::is_read(extension)) add("extension " + extension + " is not read");
  }
  for (const std::string& note : file.notes) add(note);
  std::size_t morphed = 0;
  for (const gltf::Mesh& mesh : file.meshes) {
    for (const gltf::Primitive& primitive : mesh.primitives) {
      morphed += primitive.morphs_more ? 1 : 0;
    }
  }
  if (morphed > 0)
    add(fmt::format(
        "{} parts have morph targets of colours or texture coordinates, which are not read",
        morphed));
  if (const std::string found = gltf::surfaceless_parts(file); !found.empty())
    add("not shown: " + found);
}

/// Materials of the job that no object has and no file: meant to replace one of a file?
void warn_of_names(const SceneSpec& scene, const std::set<std::string>& used,
                   const std::set<std::string>& in_files, std::vector<std::string>& warnings) {
  for (const auto& [name, material] : scene.materials) {
    if (used.contains(name) || in_files.contains(name)) continue;
    warnings.push_back(fmt::format(
        "scene.materials: no object has material \"{}\", nor is it one of the glTF file{}", name,
        suggestion(name, std::vector<std::string>(in_files.begin(), in_files.end()))));
  }
}

}  // namespace

std::vector<std::string> scene_warnings(const JobSpec& job) {
  const SceneSpec& scene = job.scene;
  std::vector<std::string> warnings;
  const std::set<std::string> used = used_materials(scene);
  for (const auto& [name, material] : scene.materials) {
    if (used.contains(name) && !(material.emission == Rgb{}))
      warnings.push_back(fmt::format("material \"{}\": it glows, {}", name,
                                     job.light.bounces == 0
                                         ? "but lights nothing, as light.bounces is 0"
                                         : "and lights what finds it by chance: small lamps are "
                                           "noisy, and better put into the map"));
  }

  std::set<std::string> paths, parts, names;
  for (const auto& [name, mesh] : scene.meshes) {
    if (is_gltf(mesh.path)) paths.insert(mesh.path);
    if (mesh.mesh >= 0) parts.insert(mesh.path);
  }
  for (const std::string& path : paths) {
    const auto document = gltf::read_document(path);
    if (!document) continue;
    warn_of_file(**document, warnings);
    warn_of_materials(**document, scene, used, warnings);
    for (std::string& name : gltf::material_names(**document)) names.insert(std::move(name));
  }
  if (!parts.empty()) warn_of_names(scene, used, names, warnings);
  return warnings;
}

}  // namespace baton
