#pragma once

#include <filesystem>

#include "common/base/check.h"
#include "common/base/files.h"
#include "common/job/job_spec.h"

namespace baton::test {

/// A job for coordinators without real workers: two tiles in two runs, and four frames, 1 to 4,
/// into `folder`/out. Writes its only file, which is no map, into `folder`.
inline JobSpec farm_job(const std::filesystem::path& folder) {
  BATON_CHECK(write_file_atomic(folder / "sky.hdr", as_bytes_view("sky")).ok());
  JobSpec job;
  job.name = "test";
  job.sampling.method = Method::sequential;
  for (int frame = 2; frame <= 4; ++frame) job.frames.emplace_back(frame);
  job.image = {.width = 16, .height = 8, .sites = 1, .tile_size = 8};
  job.scene.materials["grey"] = {};
  job.scene.ground = GroundSpec{.material = "grey"};
  job.environment.keys = {{1, (folder / "sky.hdr").string()}};
  job.output.directory = (folder / "out").string();
  job.state.checkpoint_every = 2;
  return job;
}

}  // namespace baton::test
