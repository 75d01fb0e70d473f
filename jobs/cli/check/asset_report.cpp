#include "jobs/cli/check/asset_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>
#include <utility>

#include "common/image/image_io.h"
#include "common/scene/object_view.h"
#include "common/scene/plate.h"
#include "common/scene/scene.h"

namespace baton {
namespace {

Result<MapReport> load_map(const std::string& path, float scale, int max_width,
                           const PixelLimit& limit) {
  BATON_ASSIGN(const RgbImage image, read_rgb_image(path, ExrWindow::display, limit));
  BATON_ASSIGN(const ImageColors colors, read_image_colors(path));
  MapReport report = report_map(path, image, scale, max_width);
  report.colors = conversion_text(colors);
  return report;
}

void load_maps(const EnvironmentSpec& environment, const PixelLimit& limit, AssetReport& report,
               std::vector<std::string>& faults) {
  std::set<std::string> seen;
  for (const EnvironmentKey& key : environment.keys) {
    if (!seen.insert(key.map).second) continue;
    const Result<MapReport> map =
        load_map(key.map, environment.scale, environment.max_width, limit);
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

void load_camera_map(const CameraMapSpec& spec, const PixelLimit& limit, AssetReport& report,
                     std::vector<std::string>& faults) {
  if (spec.file.empty()) return;
  const Result<MapReport> map = load_map(spec.file, spec.scale, 0, limit);
  if (!map) return faults.push_back(map.error().message);
  report.camera_map = *map;
}

Result<PlateReport> load_plate_file(const JobSpec& job, FrameNumber frame, const std::string& path,
                                    const PixelLimit& limit) {
  BATON_ASSIGN(const Plate plate, load_plate(job, frame, limit));
  PlateReport report{
      .path = path, .repaired = plate.repaired, .colors = {}, .notes = plate_notes(path, plate)};
  if (!is_radiance_file(path)) return report;
  BATON_ASSIGN(const ImageColors colors, read_image_colors(path));
  report.colors = conversion_text(colors);
  return report;
}

void load_plates(const JobSpec& job, const PixelLimit& limit, AssetReport& report,
                 std::vector<std::string>& faults) {
  if (!has_plate(job.output)) return;
  std::set<std::string> seen;
  for (const FrameNumber frame : job.frames) {
    const std::string path = file_at(*job.output.plate, frame);
    if (!seen.insert(path).second) continue;
    const Result<PlateReport> plate = load_plate_file(job, frame, path, limit);
    if (plate)
      report.plates.push_back(*plate);
    else
      faults.push_back(plate.error().message);
  }
}

void load_geometry(const JobSpec& job, std::uint64_t memory_bytes, AssetReport& report,
                   std::vector<std::string>& faults) {
  Result<Scene> loaded = load_scene(job, FilesBeside::any, memory_bytes);
  if (!loaded) return faults.push_back(loaded.error().message);
  report.scene = std::make_shared<const Scene>(std::move(*loaded));
  const Scene& scene = *report.scene;
  report.meshes = scene.meshes.size();
  report.instances = scene.instances.size();
  for (const TriangleMesh& mesh : scene.meshes)
    report.deforming_meshes += mesh.deformation != nullptr ? 1 : 0;
  report.dropped_triangles = count_dropped(scene);
  for (const Instance& instance : scene.instances) {
    report.triangles += scene.meshes[instance.mesh].triangles.size();
    report.objects_move = report.objects_move || instance.moves();
  }
  report.odd_geometry = geometry_warnings(job, scene);
}

}  // namespace

Result<AssetReport> load_assets(const JobSpec& job, std::uint64_t memory_bytes) {
  // What a decoder and its colours take.
  const PixelLimit pictures = PixelLimit::in_memory(memory_bytes, 28, "this program's");
  AssetReport report;
  std::vector<std::string> faults;
  load_geometry(job, memory_bytes, report, faults);
  load_maps(job.environment, pictures, report, faults);
  load_camera_map(job.environment.camera_map, pictures, report, faults);
  load_plates(job, pictures, report, faults);
  if (!faults.empty())
    return Error{ErrorKind::bad_input, fmt::format("{}", fmt::join(faults, "\n"))};
  return report;
}

}  // namespace baton
