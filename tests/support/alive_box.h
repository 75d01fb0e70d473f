#pragma once

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/gltf_files.h"
#include "tests/support/small_scene.h"

namespace baton::test {

/// A box of side 1 around the origin, flat, in four floors. Within `seconds` its upper half bends
/// by `bend` radians, as the skin of two bones, and it grows in height by the share `stretch`, as a
/// morph target says.
inline std::string alive_box_glb(float seconds, float bend, float stretch) {
  std::vector<float> positions, weights, steps;
  std::vector<std::uint8_t> joints;
  constexpr std::array<std::array<float, 2>, 4> kCorners{
      {{-0.5f, -0.5f}, {0.5f, -0.5f}, {0.5f, 0.5f}, {-0.5f, 0.5f}}};
  for (int floor = 0; floor <= 4; ++floor) {
    const float h = 0.25f * static_cast<float>(floor);
    const float share = h * h * (3 - 2 * h);
    for (const auto& [x, z] : kCorners) {
      positions.insert(positions.end(), {x, h - 0.5f, z});
      joints.insert(joints.end(), {0, 1, 0, 0});
      weights.insert(weights.end(), {1 - share, share, 0, 0});
      steps.insert(steps.end(), {0, h, 0});
    }
  }
  std::vector<std::uint16_t> corners{0, 1, 2, 0, 2, 3, 16, 18, 17, 16, 19, 18};
  for (std::uint16_t floor = 0; floor < 4; ++floor) {
    for (std::uint16_t k = 0; k < 4; ++k) {
      const auto a = static_cast<std::uint16_t>(4 * floor + k);
      const auto b = static_cast<std::uint16_t>(4 * floor + (k + 1) % 4);
      const auto c = static_cast<std::uint16_t>(a + 4), d = static_cast<std::uint16_t>(b + 4);
      corners.insert(corners.end(), {a, c, b, b, c, d});
    }
  }
  GltfWriter w;
  w.add(positions, "VEC3", 3);                         // 0
  w.add(joints, "VEC4", 4);                            // 1
  w.add(weights, "VEC4", 4);                           // 2
  w.add(steps, "VEC3", 3);                             // 3
  w.add(corners, "SCALAR", 1);                         // 4
  w.add(std::vector<float>{0, seconds}, "SCALAR", 1);  // 5
  w.add(std::vector<float>{0, 0, 0, 1, 0, 0, std::sin(bend / 2), std::cos(bend / 2)}, "VEC4",
        4);                                                                    // 6
  w.add(std::vector<float>{0, stretch}, "SCALAR", 1);                          // 7
  w.add(std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0.5f, 0, 1,  //
                           1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0,    0, 1},
        "MAT4", 16);  // 8
  return w.glb(R"("scenes":[{"nodes":[0,1]}],
    "nodes":[{"name":"box","mesh":0,"skin":0},{"children":[2],"translation":[0,-0.5,0]},
             {"translation":[0,0.5,0]}],
    "meshes":[{"name":"box","primitives":[{"attributes":{"POSITION":0,"JOINTS_0":1,"WEIGHTS_0":2},
               "targets":[{"POSITION":3}],"indices":4}]}],
    "skins":[{"joints":[1,2],"inverseBindMatrices":8}],
    "animations":[{"samplers":[{"input":5,"output":6},{"input":5,"output":7}],
                   "channels":[{"sampler":0,"target":{"node":2,"path":"rotation"}},
                               {"sampler":1,"target":{"node":0,"path":"weights"}}]}])");
}

/// Makes the second box of box_job one that bends and grows, by so much over the job's frames.
inline void set_deforming(JobSpec& job, float bend, float stretch) {
  const auto frames = static_cast<float>(job.frames.size());
  const std::filesystem::path file = test_folder() / "alive.glb";
  std::ofstream(file, std::ios::binary) << alive_box_glb(frames / 24, bend, stretch);
  job.scene.meshes["alive"] = {
      .path = file.string(),
      .mesh = 0,
      .shaped_by = ShapeSpec{.node = 0, .animation = FileClock{.fps = 24, .start_frame = 1}}};
  job.scene.objects[1].mesh = "alive";
  job.motion.max_px = 4;
}

/// Shows a sheet just above the ground alone, from x = -0.6 to 0 in frame 1, that is twice as long
/// in frame 2.
inline void show_stretching_sheet(JobSpec& job) {
  constexpr float kY = 0.01f;
  GltfWriter w;
  w.add(std::vector<float>{-0.6f, kY, -0.3f, -0.6f, kY, 0.3f, 0, kY, 0.3f, 0, kY, -0.3f}, "VEC3",
        3);
  w.add(std::vector<float>{0, 0, 0, 0, 0, 0, 0.6f, 0, 0, 0.6f, 0, 0}, "VEC3", 3);
  w.add(std::vector<std::uint8_t>{0, 1, 2, 0, 2, 3}, "SCALAR", 1);
  w.add(std::vector<float>{0, 1}, "SCALAR", 1);
  const std::filesystem::path file = test_folder() / "sheet.glb";
  std::ofstream(file, std::ios::binary) << w.glb(R"("nodes":[{"mesh":0}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0},"targets":[{"POSITION":1}],"indices":2}]}],
      "animations":[{"samplers":[{"input":3,"output":3}],
                     "channels":[{"sampler":0,"target":{"node":0,"path":"weights"}}]}])");
  job.scene.meshes["sheet"] = {
      .path = file.string(),
      .mesh = 0,
      .shaped_by = ShapeSpec{.animation = FileClock{.fps = 1, .start_frame = 1}}};
  job.scene.objects = {{.mesh = "sheet", .material = "metal"}};
}

}  // namespace baton::test
