#include "common/scene/settle/animations.h"

#include <fmt/format.h>

#include <set>

#include "common/scene/gltf/file_cache.h"
#include "common/scene/gltf/names.h"

namespace baton {

std::vector<AnimationUse> animations_of(const JobSpec& job) {
  std::set<std::pair<std::string, std::string>> wanted;  // file, choice
  if (job.scene.gltf) wanted.insert({job.scene.gltf->file, job.scene.gltf->animation});
  if (job.camera.gltf) wanted.insert({job.camera.gltf->file, job.camera.gltf->animation});
  for (const ObjectSpec& object : job.scene.objects) {
    if (object.gltf) wanted.insert({object.gltf->file, object.gltf->animation});
  }
  for (const auto& [name, mesh] : job.scene.meshes) {
    if (mesh.deforms()) wanted.insert({mesh.path, mesh.shaped_by->animation->animation});
  }

  std::vector<AnimationUse> uses;
  gltf::FileCache files;
  for (const auto& [file, choice] : wanted) {
    const auto document = files.get(file);
    if (!document || (*document)->animations.empty()) continue;
    const Result<int> played = gltf::find_animation(**document, choice);
    if (played) uses.push_back({file, gltf::animation_names(**document), *played});
  }
  return uses;
}

std::string text_of(const AnimationUse& use) {
  const std::string names = gltf::shown_names(use.names);
  if (use.played < 0)
    return fmt::format("{}: {} play{}", use.file, names, use.names.size() > 1 ? "" : "s");
  return fmt::format("{}: \"{}\" plays, of {}", use.file,
                     use.names[static_cast<std::size_t>(use.played)], names);
}

}  // namespace baton
