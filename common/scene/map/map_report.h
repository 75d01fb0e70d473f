#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/image/image_io.h"
#include "common/job/job_spec.h"

namespace baton {

/// What a file says that is used as a map.
struct MapReport {
  std::string path;
  int width = 0, height = 0;            ///< texels in force
  int file_width = 0, file_height = 0;  ///< what the file holds
  /// Texels that are negative, NaN or infinite, taken as 0.
  std::uint64_t repaired_texels = 0;
  bool black = false;
  float brightest = 0;  ///< the largest finite channel of the file
  /// Mean radiance over the sphere and the three channels, of finite values.
  float mean = 0;
  /// What was converted (conversion_text); empty: nothing, or not asked.
  std::string colors{};
  std::vector<std::string> notes{};  ///< RgbImage::notes
};

/// image: what was read of the file. scale, max_width: of the environment.
MapReport report_map(const std::string& path, const RgbImage& image, float scale, int max_width);

/// What a person should know of it, one line each: `texels` of any map, also one that only the
/// camera sees; `light` of one that lights.
std::vector<std::string> texel_warnings(const MapReport& map);
std::vector<std::string> light_warnings(const MapReport& map);

/// A line where the light changes at once from one frame to the next: its mean by a factor of two,
/// or from one key's map to another's within a frame. Numbered maps are a film, so that there only
/// the mean tells. mean: of the map of a key.
std::optional<std::string> light_jump(const EnvironmentSpec& environment, FrameNumber from,
                                      FrameNumber to,
                                      const std::function<float(std::int32_t key)>& mean);
/// Jumps of a job that are told one by one.
inline constexpr std::size_t kMostJumps = 3;

}  // namespace baton
