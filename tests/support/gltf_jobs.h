#pragma once

#include <gtest/gtest.h>

#include <string>

#include "common/job/text/job_json.h"
#include "common/scene/settle/settle_motion.h"
#include "tests/support/gltf_files.h"
#include "tests/support/mesh_files.h"

/// Jobs of small glTF files.
namespace baton::test {

/// Two leaves that share a mesh of two primitives, one of them mirrored, below "tree"; a camera
/// "eye"; "stone" and "leaf" as materials.
inline std::string still_set(const std::string& more = "") {
  GltfWriter w;
  w.add(kTriangle, "VEC3", 3);
  return write_test_file("still.glb", w.glb(R"("scenes":[{"nodes":[0,3]}],
    "nodes":[{"name":"tree","children":[1,2],"translation":[1,0,0]},
             {"name":"left","mesh":0,"scale":[-1,1,1]},{"name":"right","mesh":0,"translation":[0,2,0]},
             {"name":"eye","camera":0,"translation":[0,0,4]}],
    "cameras":[{"type":"perspective","perspective":{"yfov":0.8,"znear":0.1}}],
    "materials":[{"name":"stone","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1],
                    "metallicFactor":0.5,"roughnessFactor":0}},
                 {"name":"leaf"}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0},
                             {"attributes":{"POSITION":0},"material":1}]}])" +
                                            more));
}

inline JobSpec job_of(const std::string& file, const std::string& scene = "",
                      const std::string& rest = "") {
  const Result<JobSpec> job = parse_job(
      R"({"name": "j", "frames": "1-3", "environment": {"map": "/m.exr"}, "scene": {"gltf": {"file": ")" +
          file + "\"" + (scene.starts_with(',') ? scene : "}" + scene) + "}" + rest + "}",
      "job", "/");
  EXPECT_TRUE(job) << (job ? "" : job.error().message);
  return job ? *job : JobSpec{};
}

inline JobSpec settled(const JobSpec& job) {
  const Result<JobSpec> result = settle_motion(job);
  EXPECT_TRUE(result) << (result ? "" : result.error().message);
  return result ? *result : JobSpec{};
}

inline std::string error_of(const JobSpec& job) {
  const Result<JobSpec> result = settle_motion(job);
  return result ? "none" : result.error().message;
}

}  // namespace baton::test
