#pragma once

#include <gtest/gtest.h>

#include <map>

#include "common/base/files.h"
#include "common/image/image_io.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "tests/support/local_frames.h"
#include "worker/run/execute.h"

namespace baton::testing_run {

using Images = std::map<Step, FilmTile>;

/// A tetrahedron on a ground under a map with one lamp: 5 frames of 40x24 pixels in tiles of 16,
/// checkpoints every 2.
class ExecuteTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = testing::TempDir() + "execute_" + name + "/";
    std::filesystem::remove_all(folder_);  // frames of an earlier run are none of this job
    ASSERT_TRUE(write_file_atomic(folder_ + "tetrahedron.off",
                                  as_bytes_view("OFF\n4 4 0\n1 1 1\n-1 -1 1\n-1 1 -1\n1 -1 -1\n"
                                                "3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")));
    write_map();

    job_.name = "execute";
    job_.frames = parse_frames("1-5").value();
    job_.image = {.width = 40, .height = 24, .sites = 1, .tile_size = 16};
    job_.scene.materials["chalk"] = {};
    job_.scene.meshes["tetrahedron"] = {.path = folder_ + "tetrahedron.off",
                                        .smooth_normals = false};
    ObjectSpec object;
    object.mesh = "tetrahedron";
    object.material = "chalk";
    object.translate = {0, 0.5f, 0};
    job_.scene.objects = {object};
    job_.scene.ground = GroundSpec{.material = "chalk", .height = -0.6f, .size = 20};
    job_.environment.keys = {{.frame = 1, .map = folder_ + "map.exr"}};
    job_.environment.rotation_deg_per_frame = 3;
    job_.sampling.method = Method::sequential;
    job_.sampling.num_candidates = 32;
    job_.output.directory = folder_ + "frames";
    job_.state.checkpoint_every = 2;

    const Result<LoadedJobPtr> loaded = load();
    ASSERT_TRUE(loaded) << loaded.error().message;
    loaded_ = *loaded;
  }

  void write_map() const {
    FilmTile map{.rect = {0, 0, 16, 8}, .channels = {"R", "G", "B"}, .values = {}};
    map.values.assign(3 * map.num_pixels(), 0.5f);
    for (std::size_t channel = 0; channel < 3; ++channel) map.plane(channel)[2 * 16 + 5] = 50;
    ASSERT_TRUE(write_exr(folder_ + "map.exr", map, {}));
  }

  Result<LoadedJobPtr> load() const {
    BATON_ASSIGN(const std::string document, make_job_document(job_));
    AssetShelf shelf;
    JobEntry entry(
        digest_of(document),
        [&](const JobDocument& given) { return load_job_document(given, {}, shelf); },
        std::make_shared<JobStates>(std::make_shared<MemoryShare>(1 << 24)));
    entry.provide({digest_of(document), document});
    return entry.load({});
  }
  /// Counts from now on how often a tile of the job is rendered.
  std::shared_ptr<int> count_renderings() const {
    auto count = std::make_shared<int>(0);
    auto& start = std::const_pointer_cast<RenderContext>(loaded_->context)->method.start;
    start = [count, start] {
      ++*count;
      return start();
    };
    return count;
  }

  StepSpan steps_of(baton::Run run) const { return Timeline(job_).steps_of(run); }
  Result<TaskResult> execute(const TaskKey& task, const std::vector<BlobRef>& inputs,
                             const StepSpan& steps = {}, bool may_hold = false,
                             Step states_from = {}, const std::stop_token& stop = {}) {
    const Grant grant{.lease = {.job = loaded_->digest, .task = task},
                      .inputs = inputs,
                      .steps = steps,
                      .may_hold = may_hold,
                      .states_from = states_from};
    return execute_task(*loaded_, store_.value(), grant, stop);
  }
  Result<TaskResult> render(baton::Run run, std::int32_t tile, const std::vector<BlobRef>& inputs) {
    return execute(render_task(run, tile), inputs, steps_of(run));
  }

  /// Every render task in the order of a farm; returns the films by frame, the states in `states_`.
  std::map<Step, std::vector<BlobRef>> render_all() {
    std::map<Step, std::vector<BlobRef>> films;
    for (std::int32_t tile = 0; tile < TileGrid(job_.image).count(); ++tile) {
      std::vector<BlobRef> previous;
      for (baton::Run run; run < baton::Run(num_runs(job_)); ++run) {
        const Result<TaskResult> output = render(run, tile, previous);
        EXPECT_TRUE(output) << output.error().message;
        previous.clear();
        for (const BlobRef& ref : output->made.outputs) {
          (ref.kind == BlobKind::film ? films[ref.step()] : previous).push_back(ref);
        }
      }
    }
    return films;
  }

  Images render_in_process() {
    Images images;
    const auto stats =
        test::render_locally(*loaded_->context, [&](Step step, const FilmTile& image) {
          EXPECT_TRUE(images.emplace(step, image).second);
          return Status();
        });
    EXPECT_TRUE(stats) << stats.error().message;
    EXPECT_EQ(stats->pixels, 5u * 40 * 24);
    return images;
  }

  std::string folder_;
  JobSpec job_;
  LoadedJobPtr loaded_;
  Result<BlobStore> store_ = BlobStore::open(testing::TempDir() + "execute_store");
};

}  // namespace baton::testing_run
