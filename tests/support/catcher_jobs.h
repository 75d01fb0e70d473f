#pragma once

#include <fstream>

#include "tests/support/render_tiled.h"

namespace baton::test {

/// A sphere of radius 1 of few triangles, as OBJ text: its normals are far from those of its faces.
inline std::string coarse_sphere_obj(int rings = 8, int sectors = 12) {
  std::string text;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(rings);
      const float phi = 2 * kPi * static_cast<float>(j) / static_cast<float>(sectors);
      text += "v " + std::to_string(std::sin(theta) * std::cos(phi)) + " " +
              std::to_string(std::cos(theta)) + " " +
              std::to_string(std::sin(theta) * std::sin(phi)) + "\n";
    }
  }
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const auto at = [&](int a, int b) { return std::to_string(a * sectors + b % sectors + 1); };
      if (i > 0) text += "f " + at(i, j) + " " + at(i, j + 1) + " " + at(i + 1, j) + "\n";
      if (i + 1 < rings)
        text += "f " + at(i, j + 1) + " " + at(i + 1, j + 1) + " " + at(i + 1, j) + "\n";
    }
  }
  return text;
}

/// The boxes of sequence_job on a ball that catches their shadows, listed last, under a sky that
/// turns fast. No ground.
inline JobSpec ball_job(Method method, int frames) {
  JobSpec job = sequence_job(frames);
  const std::filesystem::path mesh = test_folder() / "ball.obj";
  std::ofstream(mesh) << coarse_sphere_obj();
  job.environment.rotation_deg_per_frame = 15;
  job.sampling.method = method;
  job.sampling.num_candidates = 32;
  job.scene.ground.reset();
  job.scene.meshes["ball"] = {.path = mesh.string(), .smooth_normals = true};
  job.scene.objects.push_back({.mesh = "ball",
                               .material = "ground",
                               .translate = {0, -1.7f, 0},
                               .scale = {2.4f, 2, 2},
                               .catcher = true});
  job.image.site_seed = 99;  // jobs of other seeds see the same points
  job.output.background = Background::transparent;
  job.output.aovs = {Aov::normal, Aov::depth, Aov::object};
  return job;
}

/// Lets a box and the ball move, and the camera if it shall.
inline void set_all_in_motion(JobSpec& job, bool camera = true) {
  set_in_motion(job, camera, true);
  const auto last = static_cast<double>(job.frames.size() + 1);
  job.scene.objects.back().keys = {
      {.frame = 1}, {.frame = last, .translate = {0.1f, 0.05f, 0}, .rotate_deg = {0, 20, 10}}};
}

}  // namespace baton::test
