#pragma once

#include <filesystem>
#include <string>

#include "common/image/image_io.h"
#include "common/job/job_spec.h"

namespace baton::stability {

/// The folder that a case's generated maps and meshes live in, and the bricks that its scenes are
/// made of.
class Stage {
 public:
  /// Makes the folder.
  explicit Stage(std::filesystem::path folder);

  /// Writes a float EXR and returns its path. Stops the program when the disk fails.
  std::string map(const std::string& name, const RgbImage& image) const;
  /// Writes an OBJ and returns its path.
  std::string mesh(const std::string& name, const std::string& obj) const;

  /// A job over `map` with a ground of material "ground" (diffuse, albedo 0.5), seen obliquely from
  /// above in 8 x 8 pixels: one site, 16 particles of 128 candidates, transparent background, the
  /// AOVs that the suite reads.
  JobSpec plain(const RgbImage& map) const;
  /// plain() with two boxes of the ground's material that shade the ground and each other.
  JobSpec boxes(const RgbImage& map) const;
  /// Adds a flat-shaded mesh as an object of its own material.
  void add(JobSpec& job, const std::string& name, const std::string& obj,
           const MaterialSpec& material, bool smooth = false) const;

 private:
  std::filesystem::path folder_;
};

/// (ks, kd) Phong of white lobes over albedo 0.6.
MaterialSpec phong(float exponent, float ks, float kd);
MaterialSpec diffuse(const Rgb& albedo);

/// OBJ text of an axis-aligned box.
std::string box_obj(const Vec3& low, const Vec3& high);
/// OBJ text of horizontal rectangles at height y: the cells (i, j) with i + j even of a columns x
/// rows board, cells of side `cell`, centred on the origin.
std::string checker_obj(int columns, int rows, float cell, float y);
/// OBJ text of a horizontal square plate of side `size` at height y with a square hole of side
/// `hole` in its middle.
std::string pierced_plate_obj(float size, float hole, float y);
/// OBJ text of a coarse sphere of radius 1, 8 x 4 faces: interpolated normals differ much from the
/// facets'.
std::string sphere_obj();

}  // namespace baton::stability
