#include "jobs/cli/asset_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "common/image/image_io.h"
#include "common/math/vec3.h"
#include "jobs/cli/object_view.h"
#include "jobs/cli/surface_share.h"
#include "worker/scene/map_reduction.h"
#include "worker/scene/scene.h"

namespace baton {
namespace {

float mean_over_sphere(const RgbImage& image) {
  const auto row_values = static_cast<std::size_t>(3 * image.width);
  double sum = 0, weights = 0;
  for (int y = 0; y < image.height; ++y) {
    const double weight = std::sin((y + 0.5) * double{kPi} / image.height);
    const auto row =
        std::span(image.rgb).subspan(static_cast<std::size_t>(y) * row_values, row_values);
    for (const float v : row) sum += std::isfinite(v) && v > 0 ? weight * v : 0.0;
    weights += weight * static_cast<double>(row_values);
  }
  return weights > 0 ? static_cast<float>(sum / weights) : 0.0f;
}

Result<MapReport> load_map(const std::string& path, const EnvironmentSpec& environment) {
  BATON_ASSIGN(const RgbImage image, read_rgb_image(path));
  const EnvironmentMap map = make_map(image, environment, false);
  float brightest = 0;
  for (const float v : image.rgb) brightest = std::isfinite(v) ? std::max(brightest, v) : brightest;
  BATON_ASSIGN(const PictureColors colors, read_picture_colors(path));
  return MapReport{.path = path,
                   .width = map.width(),
                   .height = map.height(),
                   .file_width = image.width,
                   .file_height = image.height,
                   .repaired_texels = map.repairs().total(),
                   .black = map.black(),
                   .brightest = brightest,
                   .colors = conversion_text(colors),
                   .mean = mean_over_sphere(image)};
}

void load_maps(const EnvironmentSpec& environment, AssetReport& report,
               std::vector<std::string>& faults) {
  std::set<std::string> seen;
  for (const EnvironmentKey& key : environment.keys) {
    if (!seen.insert(key.map).second) continue;
    const Result<MapReport> map = load_map(key.map, environment);
    if (!map) {
      faults.push_back(map.error().message);
      continue;
    }
    report.maps.push_back(*map);

    // Mixing goes texel by texel.
    const MapReport& first = report.maps.front();
    if (environment.interpolate && (map->width != first.width || map->height != first.height)) {
      faults.push_back(fmt::format("{}: expected {}x{} texels as in {}, to mix them, got {}x{}",
                                   map->path, first.width, first.height, first.path, map->width,
                                   map->height));
    }
  }
}

/// A map that the camera sees can be read; nothing else is asked of it.
void load_camera_map(const EnvironmentSpec& environment, std::vector<std::string>& faults) {
  const std::string& file = environment.camera_map.file;
  if (file.empty()) return;
  if (const auto image = read_rgb_image(file); !image) faults.push_back(image.error().message);
}

void load_geometry(const JobSpec& job, AssetReport& report, std::vector<std::string>& faults) {
  const Result<Scene> scene = load_scene(job);
  if (!scene) return faults.push_back(scene.error().message);
  report.meshes = scene->meshes.size();
  report.instances = scene->instances.size();
  for (const TriangleMesh& mesh : scene->meshes) {
    report.dropped_triangles += mesh.dropped_triangles;
    report.deforming_meshes += mesh.deformation != nullptr ? 1 : 0;
  }
  for (const Instance& instance : scene->instances) {
    report.triangles += scene->meshes[instance.mesh].triangles.size();
    report.objects_move = report.objects_move || instance.moves();
  }
  report.surface_share = surface_share(job, *scene);
  report.odd_objects = object_warnings(job, *scene);
}

}  // namespace

Result<AssetReport> load_assets(const JobSpec& job) {
  AssetReport report;
  std::vector<std::string> faults;
  load_geometry(job, report, faults);
  load_maps(job.environment, report, faults);
  load_camera_map(job.environment, faults);
  if (!faults.empty())
    return Error{ErrorKind::bad_input, fmt::format("{}", fmt::join(faults, "\n"))};
  return report;
}

}  // namespace baton
