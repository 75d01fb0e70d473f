#include "common/job/text/path_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Without dots, doubled slashes and a slash at the end.
fs::path plain(const std::string& text) {
  const fs::path path = fs::path(text).lexically_normal();
  return path.has_filename() || path == path.root_path() ? path : path.parent_path();
}

}  // namespace

Result<PathMap> parse_path_map(const std::string& text) {
  const std::size_t middle = text.find('=');
  const std::string from = text.substr(0, middle);
  const std::string to = middle == text.npos ? "" : text.substr(middle + 1);
  if (!fs::path(from).is_absolute() || !fs::path(to).is_absolute()) {
    return Error{ErrorKind::usage, fmt::format("--map {}: expected two absolute paths, as in "
                                               "/studio/shows=/mnt/shows",
                                               text)};
  }
  return PathMap{plain(from).string(), plain(to).string()};
}

std::string map_path(const std::string& path, const PathMaps& maps) {
  const fs::path whole = plain(path);
  std::string mapped = path;
  std::ptrdiff_t longest = 0;
  for (const PathMap& map : maps) {
    const fs::path from(map.from);
    const auto [end, rest] = std::mismatch(from.begin(), from.end(), whole.begin(), whole.end());
    const std::ptrdiff_t length = std::distance(from.begin(), from.end());
    if (end != from.end() || length <= longest) continue;
    longest = length;
    fs::path to(map.to);
    for (auto name = rest; name != whole.end(); ++name) to /= *name;
    mapped = to.string();
  }
  return mapped;
}

JobSpec map_paths(JobSpec job, const PathMaps& maps) {
  const auto map = [&](std::string& path) {
    if (!path.empty()) path = map_path(path, maps);
  };
  map(job.output.directory);
  if (job.camera.gltf) map(job.camera.gltf->file);
  if (job.scene.gltf) map(job.scene.gltf->file);
  for (auto& [name, material] : job.scene.materials) {
    map(material.file);
    for (TextureSpec* const texture : textures_of(material)) map(texture->file);
  }
  for (auto& [name, mesh] : job.scene.meshes) map(mesh.path);
  for (FileSpec& file : job.scene.files) map(file.path);
  for (ObjectSpec& object : job.scene.objects) {
    if (object.gltf) map(object.gltf->file);
  }
  for (EnvironmentKey& key : job.environment.keys) map(key.map);
  map(job.environment.camera_map.file);
  if (job.output.plate) map(job.output.plate->files);
  return job;
}

std::vector<AssetDigest> map_paths(std::vector<AssetDigest> assets, const PathMaps& maps) {
  for (AssetDigest& asset : assets) asset.path = map_path(asset.path, maps);
  return assets;
}

}  // namespace baton
