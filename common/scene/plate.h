#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/image/image_io.h"
#include "common/job/job_spec.h"

namespace baton {

/// A picture that frames are laid over.
struct Plate {
  RgbImage picture;
  /// Pixels of the file that are NaN or infinite, taken as 0.
  std::uint64_t repaired = 0;
  std::vector<std::string> notes{};  ///< RgbImage::notes
};

/// The plate of a frame of a job with plates, as large as the whole picture of the job: each pixel
/// is the mean of the file over it. Linear Rec. 709; integers are taken as sRGB, alpha is dropped.
/// What is NaN or infinite becomes 0, what is below zero stays. Errors name the file: missing, not
/// an image, smaller than the picture or of another shape, larger than `limit`.
Result<Plate> load_plate(const JobSpec& job, FrameNumber frame, const PixelLimit& limit = {});

/// Whether a plate is an EXR or Radiance HDR file, whose header may say what its numbers are
/// (read_image_colors); by its name.
bool is_radiance_file(const std::string& path);

/// What a person should know of a plate, a line each: "shot.0012.exr: 7 pixels are NaN or infinite
/// and count as 0".
std::vector<std::string> plate_notes(const std::string& path, const Plate& plate);

}  // namespace baton
