#include "jobs/cli/asset_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <utility>

#include "common/image/image_io.h"
#include "common/math/vec3.h"
#include "jobs/cli/object_view.h"
#include "worker/scene/map_reduction.h"
#include "worker/scene/plate.h"
#include "worker/scene/scene.h"

namespace baton {
namespace {

/// What the texels of a picture are, one by one.
struct TexelReport {
  double mean = 0;  ///< over the sphere and the three channels, of what is finite and positive
  float brightest = 0;
  TexelRepairs repairs;
};

TexelReport look_at_texels(const RgbImage& image, float scale) {
  const auto row_values = static_cast<std::size_t>(3 * image.width);
  TexelReport report;
  double sum = 0, weights = 0;
  for (int y = 0; y < image.height; ++y) {
    const auto row =
        std::span(image.rgb).subspan(static_cast<std::size_t>(y) * row_values, row_values);
    double row_sum = 0;
    for (const float v : row) {
      if (!std::isfinite(v) || v <= 0) continue;
      row_sum += v;
      report.brightest = std::max(report.brightest, v);
    }
    for (std::size_t i = 0; i < row_values; i += 3) texel_radiance(&row[i], scale, report.repairs);
    const double weight = std::sin((y + 0.5) * double{kPi} / image.height);
    sum += weight * row_sum;
    weights += weight * static_cast<double>(row_values);
  }
  report.mean = weights > 0 ? sum / weights : 0.0;
  return report;
}

Result<MapReport> load_map(const std::string& path, float scale, int max_width) {
  BATON_ASSIGN(const RgbImage image, read_rgb_image(path));
  BATON_ASSIGN(const PictureColors colors, read_picture_colors(path));
  const TexelReport texels = look_at_texels(image, scale);
  const auto [width, height] = map_sides(image.width, image.height, max_width);
  return MapReport{.path = path,
                   .width = width,
                   .height = height,
                   .file_width = image.width,
                   .file_height = image.height,
                   .repaired_texels = texels.repairs.total(),
                   .black = !(texels.mean * double{scale} > 0),
                   .brightest = texels.brightest,
                   .colors = conversion_text(colors),
                   .mean = static_cast<float>(texels.mean)};
}

void load_maps(const EnvironmentSpec& environment, AssetReport& report,
               std::vector<std::string>& faults) {
  std::set<std::string> seen;
  for (const EnvironmentKey& key : environment.keys) {
    if (!seen.insert(key.map).second) continue;
    const Result<MapReport> map = load_map(key.map, environment.scale, environment.max_width);
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

void load_camera_map(const CameraMapSpec& spec, AssetReport& report,
                     std::vector<std::string>& faults) {
  if (spec.file.empty()) return;
  const Result<MapReport> map = load_map(spec.file, spec.scale, 0);
  if (!map) return faults.push_back(map.error().message);
  report.camera_map = *map;
}

Result<PlateReport> load_plate_file(const JobSpec& job, int frame, const std::string& path) {
  BATON_ASSIGN(const Plate plate, load_plate(job, frame));
  PlateReport report{.path = path, .repaired = plate.repaired, .colors = {}};
  if (!is_radiance_file(path)) return report;
  BATON_ASSIGN(const PictureColors colors, read_picture_colors(path));
  report.colors = conversion_text(colors);
  return report;
}

void load_plates(const JobSpec& job, AssetReport& report, std::vector<std::string>& faults) {
  if (!has_plate(job.output)) return;
  std::set<std::string> seen;
  for (const int frame : job.frames) {
    const std::string path = file_at(*job.output.plate, frame);
    if (!seen.insert(path).second) continue;
    const Result<PlateReport> plate = load_plate_file(job, frame, path);
    if (plate)
      report.plates.push_back(*plate);
    else
      faults.push_back(plate.error().message);
  }
}

void load_geometry(const JobSpec& job, AssetReport& report, std::vector<std::string>& faults) {
  Result<Scene> loaded = load_scene(job);
  if (!loaded) return faults.push_back(loaded.error().message);
  report.scene = std::make_shared<const Scene>(std::move(*loaded));
  const Scene& scene = *report.scene;
  report.meshes = scene.meshes.size();
  report.instances = scene.instances.size();
  for (const TriangleMesh& mesh : scene.meshes) {
    report.dropped_triangles += mesh.dropped_triangles;
    report.deforming_meshes += mesh.deformation != nullptr ? 1 : 0;
  }
  for (const Instance& instance : scene.instances) {
    report.triangles += scene.meshes[instance.mesh].triangles.size();
    report.objects_move = report.objects_move || instance.moves();
  }
  report.odd_objects = object_warnings(job, scene);
}

}  // namespace

Result<AssetReport> load_assets(const JobSpec& job) {
  AssetReport report;
  std::vector<std::string> faults;
  load_geometry(job, report, faults);
  load_maps(job.environment, report, faults);
  load_camera_map(job.environment.camera_map, report, faults);
  load_plates(job, report, faults);
  if (!faults.empty())
    return Error{ErrorKind::bad_input, fmt::format("{}", fmt::join(faults, "\n"))};
  return report;
}

}  // namespace baton
