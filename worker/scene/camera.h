#pragma once

#include "common/job/job_spec.h"
#include "common/math/vec3.h"

namespace baton {

struct Ray {
  Vec3 origin;
  Vec3 direction;  ///< unit
};

/// Pinhole camera. Pixel coordinates: (0, 0) is the upper left corner of the upper left pixel, x to the right, y down.
class Camera {
 public:
  Camera() = default;
  Camera(const CameraSpec& spec, int width, int height);

  /// Ray through image position (x, y) in pixels.
  Ray ray(float x, float y) const;

 private:
  Vec3 origin_;
  Vec3 right_{1, 0, 0};     ///< image-plane step of one pixel
  Vec3 down_{0, -1, 0};
  Vec3 corner_{0, 0, -1};   ///< direction of position (0, 0), not unit
};

}  // namespace baton
