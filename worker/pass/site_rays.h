#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/job/job_spec.h"
#include "common/math/philox.h"
#include "common/scene/camera.h"

namespace baton {

/// Where a pixel's rays of all frames and rounds lie: bits of step 0 place sites, of step 1 they
/// shift the lens, of step 2 they place the probes of fine_sites.h.
Rng site_random(const JobSpec& job, std::int32_t x, std::int32_t y);

/// The primary rays of a round. A single site of a single round shoots through the pixel's centre,
/// if the filter is the box; else sites are jittered on a sqrt(S) x sqrt(S) grid over image.filter,
/// in each round anew (rounds_have_own_sites): those of a cell are points of a low-discrepancy
/// sequence. The same for all frames.
class SiteRays {
 public:
  /// job and camera must outlive the object.
  SiteRays(const JobSpec& job, const Camera& camera, std::int32_t round);

  /// Adds those of the `num_sites` sites of pixel (x, y). The first image.sites of them are spread
  /// over the pixel.
  void append(std::int32_t x, std::int32_t y, std::int32_t num_sites, std::vector<Ray>& rays);

 private:
  /// image.sites cells, each of them cut into 4^k where geometry is fine.
  struct Grid {
    Grid(std::int32_t coarse, std::int32_t sites);

    std::vector<float> x, y;  ///< (S) columns and rows
    float width = 1;          ///< side of a cell, in pixels
  };
  const Grid& grid_of(std::int32_t num_sites);

  const JobSpec& job_;
  const Camera& camera_;
  const ImagePlane plane_;
  const std::int32_t round_;
  const bool own_sites_;
  const std::array<std::uint32_t, 2> shift_;
  std::vector<Grid> grids_;
  std::vector<float> x_, y_;  ///< (S and a vector) of the pixel in work
};

}  // namespace baton
