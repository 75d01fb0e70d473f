#pragma once

#include <string>
#include <vector>

#include "tests/support/gltf_files.h"
#include "tests/support/mesh_files.h"

namespace baton::test {

/// What a bar of one triangle is made of, as the members of its glTF that tests vary.
struct BarParts {
  std::vector<float> positions{0, 0, 0, 2, 0, 0, 2, 1, 0};
  std::vector<float> normals{0, 1, 0, 0, 1, 0, 1, 0, 0};
  std::vector<std::uint8_t> joints{0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0};
  std::vector<float> weights{1, 0, 0, 0, 0.5f, 0.5f, 0, 0, 1, 0, 0, 0};
  /// Column by column: of joint 0 and of joint 1.
  std::vector<float> inverse_binds{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,
                                   1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1};
  std::vector<float> target{0, 0, 0, 0, 0, 0, 0, 2, 0};           ///< POSITION
  std::vector<float> target_normals{0, 0, 0, 0, 0, 0, -1, 1, 0};  ///< NORMAL
  std::vector<float> times{0, 1};
  std::vector<float> rotations{0, 0, 0, 1, 0, 0, 0.70710678f, 0.70710678f};
  std::vector<float> weight_values{0, 1};
  std::string curve = "LINEAR";
  bool skinned = true, morphed = false, animated = true;
  std::string more_attributes = "", mesh_more = "", node_more = "", root_more = "", more = "";
};

/// Nodes: 0 shows the bar, far aside, 1 and 2 are its bones, 2 at (1, 0, 0) below 1. Within a
/// second bone 2 turns by a quarter about z, and the target comes on.
inline std::string bar_glb(const BarParts& parts) {
  GltfWriter w;
  w.add(parts.positions, "VEC3", 3);        // 0
  w.add(parts.normals, "VEC3", 3);          // 1
  w.add(parts.joints, "VEC4", 4);           // 2
  w.add(parts.weights, "VEC4", 4);          // 3
  w.add(parts.inverse_binds, "MAT4", 16);   // 4
  w.add(parts.target, "VEC3", 3);           // 5
  w.add(parts.target_normals, "VEC3", 3);   // 6
  w.add(parts.times, "SCALAR", 1);          // 7
  w.add(parts.rotations, "VEC4", 4);        // 8
  w.add(parts.weight_values, "SCALAR", 1);  // 9
  std::string attributes = R"("POSITION":0,"NORMAL":1)" + parts.more_attributes;
  if (parts.skinned) attributes += R"(,"JOINTS_0":2,"WEIGHTS_0":3)";
  std::string json = R"("scenes":[{"nodes":[0,1]}],"nodes":[
      {"name":"bar","mesh":0,"translation":[0,0,100])" +
                     std::string(parts.skinned ? R"(,"skin":0)" : "") + parts.node_more + R"(},
      {"name":"root","children":[2])" +
                     parts.root_more + R"(},{"name":"tip","translation":[1,0,0]}],
    "meshes":[{"primitives":[{"attributes":{)" +
                     attributes + "}" +
                     (parts.morphed ? R"(,"targets":[{"POSITION":5,"NORMAL":6}])" : "") + "}]" +
                     parts.mesh_more + "}]";
  if (parts.skinned) json += R"(,"skins":[{"joints":[1,2],"inverseBindMatrices":4}])";
  if (parts.animated) {
    const std::string sampler = R"({"input":7,"interpolation":")" + parts.curve + R"(","output":)";
    std::string channels = R"({"sampler":0,"target":{"node":2,"path":"rotation"}})";
    if (parts.morphed) channels += R"(,{"sampler":1,"target":{"node":0,"path":"weights"}})";
    json += R"(,"animations":[{"samplers":[)" + sampler + "8}," + sampler + R"(9}],"channels":[)" +
            channels + "]}]";
  }
  return w.glb(json + parts.more);
}

}  // namespace baton::test
