#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/job/job_spec.h"
#include "common/scene/map/map_report.h"
#include "common/scene/scene.h"

namespace baton {

/// A plate of the job, as read.
struct PlateReport {
  std::string path;
  std::uint64_t repaired = 0;        ///< Plate::repaired
  std::string colors;                ///< as of maps
  std::vector<std::string> notes{};  ///< plate_notes
};

/// The geometry of the job, as loaded.
struct AssetReport {
  std::vector<MapReport> maps;  ///< in the order of their first key
  std::optional<MapReport> camera_map;
  std::vector<PlateReport> plates;  ///< in the order of their first frame
  std::uint64_t meshes = 0, deforming_meshes = 0, instances = 0;
  std::uint64_t triangles = 0;  ///< in all instances
  bool objects_move = false;
  std::uint64_t dropped_triangles = 0;    ///< without area, in all meshes
  std::vector<std::string> odd_geometry;  ///< geometry_warnings
  std::shared_ptr<const Scene> scene;
};

/// Loads everything that the job names. One error lists every fault: files that cannot be loaded,
/// maps that are to be mixed but differ in size, what does not fit into so much memory.
Result<AssetReport> load_assets(const JobSpec& job, std::uint64_t memory_bytes);

}  // namespace baton
