#pragma once

#include <string>

#include "common/base/result.h"
#include "common/image/image_io.h"
#include "common/job/job_spec.h"

namespace baton {

/// The picture that a frame of a job with plates is laid over, as large as the whole picture of the
/// job: each pixel is the mean of the plate over it. Linear Rec. 709; integers are taken as sRGB,
/// alpha is dropped. Errors name the file: missing, not an image, smaller than the picture or of
/// another shape.
Result<RgbImage> load_plate(const JobSpec& job, int frame_number);

}  // namespace baton
