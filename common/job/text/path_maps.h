#pragma once

#include <string>
#include <vector>

#include "common/job/text/job_json.h"

namespace baton {

/// The folder `from` of the others is `to` on this machine.
struct PathMap {
  std::string from, to;
};
using PathMaps = std::vector<PathMap>;

/// "/studio/shows=/mnt/shows". usage: one of the two is missing or no absolute path.
Result<PathMap> parse_path_map(const std::string& text);

/// Where a path of the others is here: by the map with the longest `from` that it lies in, whole
/// names only; without one, where it is.
std::string map_path(const std::string& path, const PathMaps& maps);

/// The same for all files and folders of a job.
JobSpec map_paths(JobSpec job, const PathMaps& maps);
std::vector<AssetDigest> map_paths(std::vector<AssetDigest> assets, const PathMaps& maps);

}  // namespace baton
