#include "worker/run/execute.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/image/image_io.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"
#include "common/job/text/job_json.h"
#include "common/store/folder_token.h"
#include "tests/support/local_frames.h"
#include "tests/support/log_listener.h"
#include "worker/run/frame_output.h"
#include "worker/run/replay.h"

namespace baton {
namespace {

using Images = std::map<Step, FilmTile>;

/// A tetrahedron on a ground under a map with one lamp: 5 frames of 40x24 pixels in tiles of 16,
/// checkpoints every 2.
class ExecuteTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = testing::TempDir() + "execute_" + name + "/";
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

TEST_F(ExecuteTest, TasksThroughTheStoreMakeTheImagesOfOneProcess) {
  const Images expected = render_in_process();
  ASSERT_EQ(expected.size(), 5u);
  job_.output.pixel_type = PixelType::full_float;
  loaded_ = load().value();

  for (const auto& [step, films] : render_all()) {
    const FrameIndex frame = Timeline(job_).frame_of(step);
    const Result<TaskResult> output = execute(assemble_task(frame), films);
    ASSERT_TRUE(output) << output.error().message;
    ASSERT_EQ(output->made.outputs.size(), 1u);
    EXPECT_EQ(output->made.outputs[0].kind, BlobKind::image);

    // Compare channel by channel: a file sorts its channels.
    const FilmTile image = read_exr(frame_path(job_, frame)).value();
    const FilmTile& in_process = expected.at(step);
    for (std::size_t channel = 0; channel < in_process.channels.size(); ++channel) {
      const std::string& name = in_process.channels[channel];
      const float* const found = image.find(name);
      ASSERT_NE(found, nullptr) << name;
      EXPECT_TRUE(std::equal(in_process.plane(channel),
                             in_process.plane(channel) + image.num_pixels(), found))
          << name << " of frame " << frame.value();
    }
  }
}

TEST_F(ExecuteTest, TheNumberOfThreadsDoesNotShow) {
  const Images expected = render_in_process();
  LocalRender render(*loaded_->context);
  const std::int32_t num_tiles = TileGrid(job_.image).count();
  for (Step step; step < Step(5); ++step) {
    std::map<std::int32_t, RenderedTile> tiles;
    for (std::int32_t tile = 0; tile < num_tiles; ++tile) tiles[tile];
    std::vector<std::thread> threads;
    for (std::int32_t tile = 0; tile < num_tiles; ++tile)
      threads.emplace_back([&, tile] { tiles.at(tile) = render.render(step, tile).value(); });
    for (std::thread& thread : threads) thread.join();
    render.keep(std::move(tiles));
    RenderStats stats;
    EXPECT_EQ(test::local_image(render, job_, step, stats).value(), expected.at(step));
  }
}

TEST_F(ExecuteTest, ARunHandsOnItsStateAndCountsItsWork) {
  const Result<TaskResult> first = render(baton::Run(0), 1, {});
  ASSERT_TRUE(first) << first.error().message;
  ASSERT_EQ(first->made.outputs.size(), 3u);
  EXPECT_EQ(first->made.outputs[2].kind, BlobKind::state);
  EXPECT_EQ(first->made.outputs[2].step(), Step(1));
  EXPECT_EQ(first->made.stats.pixels, 2u * 16 * 16);
  EXPECT_EQ(render(baton::Run(0), 1, {})->made.outputs, first->made.outputs);

  // The next run needs exactly that state.
  EXPECT_TRUE(render(baton::Run(1), 1, {first->made.outputs[2]}));
  EXPECT_FALSE(render(baton::Run(1), 1, {}));
  EXPECT_FALSE(render(baton::Run(1), 0, {first->made.outputs[2]}));
  EXPECT_FALSE(render(baton::Run(1), 1, {first->made.outputs[0]}));
}

// Steps that are empty ask for the state after `last` alone, from states of exactly that step.
TEST_F(ExecuteTest, ACutRendersNothing) {
  const BlobRef state = render(baton::Run(0), 1, {}).value().made.outputs.back();
  const TaskKey task = render_task(baton::Run(0), 1);
  const auto cut = [&](Step last) { return execute(task, {state}, {last + 1, last}); };
  const Result<TaskResult> made = cut(Step(1));
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->made.outputs, std::vector<BlobRef>{state});
  EXPECT_EQ(made->made.stats.pixels, 0u);

  const Result<TaskResult> of_another_step = cut(Step(3));
  ASSERT_FALSE(of_another_step);
  EXPECT_THAT(of_another_step.error().message, testing::HasSubstr("expected"));
  EXPECT_FALSE(cut(Step(-1)));
  EXPECT_FALSE(render(baton::Run(0), 1, {state})) << "what is rendered starts from nothing here";
}

// What is held is what a file would have said: the next run makes the same films of either, and
// packing it later gives the file that packing at once does.
TEST_F(ExecuteTest, AHeldStateIsTheStateOfItsFile) {
  const TaskKey first{TaskKind::render, 0, 1}, next{TaskKind::render, 1, 1};
  const BlobRef packed = render(baton::Run(0), 1, {}).value().made.outputs.back();
  const Result<TaskResult> made = execute(first, {}, steps_of(baton::Run(0)), /*may_hold=*/true);
  ASSERT_TRUE(made) << made.error().message;
  const BlobRef held = made->made.outputs.back();
  EXPECT_TRUE(held.is_held());
  EXPECT_EQ(held.digest, held_state_name(loaded_->digest, Step(1), 1));
  EXPECT_EQ(loaded_->states->size_bytes(), loaded_->states->find(held)->size_bytes());
  EXPECT_EQ(render(baton::Run(1), 1, {held}).value().made.outputs,
            render(baton::Run(1), 1, {packed}).value().made.outputs);

  const auto published = publish_held(loaded_->states->held(), *store_);
  ASSERT_TRUE(published) << published.error().message;
  EXPECT_EQ(*published, (std::vector<PublishedState>{{held, packed}}));

  // A grant says which states nobody needs any more; one that is not here is told, and nothing
  // done.
  EXPECT_TRUE(execute(next, {held}, steps_of(baton::Run(1)), false, Step(1)));
  const Result<TaskResult> late = execute(next, {held}, steps_of(baton::Run(1)), false, Step(2));
  ASSERT_TRUE(late) << late.error().message;
  EXPECT_EQ(late->not_held, std::vector{held});
  EXPECT_TRUE(late->made.outputs.empty());
  EXPECT_EQ(loaded_->states->size_bytes(), 0u);
}

TEST_F(ExecuteTest, ADamagedOrMissingStateIsAnErrorThatNamesIt) {
  const BlobRef state = render(baton::Run(0), 0, {}).value().made.outputs.back();
  Bytes bytes = read_file(store_->path(state.digest), limits::kMaxBlobBytes).value();
  bytes[bytes.size() / 2] ^= std::byte{1};
  ASSERT_TRUE(write_file_atomic(store_->path(state.digest), bytes));
  const Result<TaskResult> damaged = render(baton::Run(1), 0, {state});
  ASSERT_FALSE(damaged);
  EXPECT_EQ(damaged.error().kind, ErrorKind::corrupt);
  EXPECT_THAT(damaged.error().message, testing::HasSubstr(state.digest.hex()));

  ASSERT_TRUE(store_->remove(state.digest));
  EXPECT_FALSE(render(baton::Run(1), 0, {state}));
}

// A disk may be away for a moment, and another machine's blob come late. What is waited for is the
// file: nothing is rendered twice.
TEST_F(ExecuteTest, AnInputThatComesLateIsWaitedFor) {
  const BlobRef state = render(baton::Run(0), 0, {}).value().made.outputs.back();
  const auto expected = render(baton::Run(1), 0, {state}).value().made.outputs;
  const std::filesystem::path blob = store_->path(state.digest), away = folder_ + "away";
  std::filesystem::rename(blob, away);
  const auto renderings = count_renderings();
  std::vector<std::string> said;
  const test::LogListener listener([&](const std::string& line) {
    said.push_back(line);
    EXPECT_EQ(*renderings, 0);
    std::filesystem::rename(away, blob);
  });
  const Result<TaskResult> made = render(baton::Run(1), 0, {state});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->made.outputs, expected);
  EXPECT_EQ(*renderings, 1);
  EXPECT_THAT(said, testing::ElementsAre(testing::AllOf(testing::StartsWith("waits for "),
                                                        testing::HasSubstr(blob.string()))));
}

TEST_F(ExecuteTest, AStoreThatIsAwayIsWaitedForWithTheFilmInHand) {
  const auto expected = render(baton::Run(0), 0, {}).value().made.outputs;
  std::filesystem::remove_all(folder_ + "store");  // of a run of this test before
  store_ = BlobStore::open(folder_ + "store");
  const auto renderings = count_renderings();
  const auto lose = [&] {
    std::filesystem::remove_all(folder_ + "store");
    ASSERT_TRUE(write_file_atomic(folder_ + "store", as_bytes_view("no folder")));
  };
  int waits = 0;
  bool comes_back = true;
  const test::LogListener listener([&](const std::string&) {
    if (++waits == 1 && comes_back) std::filesystem::remove(folder_ + "store");
  });
  lose();
  const Result<TaskResult> made = render(baton::Run(0), 0, {});
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(made->made.outputs, expected);
  EXPECT_EQ(*renderings, 1);
  EXPECT_EQ(waits, 1);

  // It fails after a while, with what the system says, and has been rendered once.
  comes_back = false;
  *renderings = 0;
  lose();
  const Result<TaskResult> failed = render(baton::Run(0), 0, {});
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().kind, ErrorKind::io);
  EXPECT_THAT(failed.error().message, testing::HasSubstr("Not a directory"));
  EXPECT_EQ(*renderings, 1);
}

// What a file is wrong with stays: its job is loaded once. What could not be read the entry of the
// job looks at again.
TEST_F(ExecuteTest, ASceneThatIsWrongIsLoadedOnce) {
  const std::string document = make_job_document(job_).value();
  int loads = 0;
  ErrorKind kind = ErrorKind::bad_input;
  AssetShelf shelf([&](const JobSpec& job, const MemoryBudget& memory,
                       std::uint64_t most) -> Result<std::shared_ptr<const SharedAssets>> {
    if (++loads == 1) return Error{kind, "tetrahedron.off: it is wrong"};
    return load_shared_assets(job, memory, most);
  });
  const auto load = [&] {
    using namespace std::chrono_literals;
    loads = 0;
    JobEntry entry(
        digest_of(document),
        [&](const JobDocument& given) { return load_job_document(given, {}, shelf); },
        loaded_->states, 1ms);
    entry.provide({digest_of(document), document});
    return entry.load({}).ok();
  };
  EXPECT_FALSE(load());
  EXPECT_EQ(loads, 1);
  kind = ErrorKind::io;
  EXPECT_TRUE(load());
  EXPECT_EQ(loads, 2);
}

// Of a file that is away for a moment the first look is repeated, and not the loading of the job.
TEST_F(ExecuteTest, AMeshThatComesLateIsWaitedFor) {
  const std::string document = make_job_document(job_).value();
  const std::string mesh = folder_ + "tetrahedron.off", away = folder_ + "away.off";
  std::filesystem::rename(mesh, away);
  int waits = 0;
  const test::LogListener listener([&](const std::string& line) {
    EXPECT_THAT(line, testing::HasSubstr(mesh));
    if (++waits == 1) std::filesystem::rename(away, mesh);
  });
  AssetShelf shelf;
  const Result<LoadedJobPtr> loaded = load_job_document({digest_of(document), document}, {}, shelf);
  EXPECT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(waits, 1);
}

// All that is wrong is said at once, after one wait.
TEST_F(ExecuteTest, FilesThatAreAwayAreNamedTogether) {
  const std::string document = make_job_document(job_).value();
  for (const char* const name : {"tetrahedron.off", "map.exr"})
    std::filesystem::remove(folder_ + name);
  int waits = 0;
  const test::LogListener listener([&](const std::string&) { ++waits; });
  AssetShelf shelf;
  const Result<LoadedJobPtr> loaded = load_job_document({digest_of(document), document}, {}, shelf);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().kind, ErrorKind::io);
  EXPECT_THAT(loaded.error().message, testing::AllOf(testing::HasSubstr("tetrahedron.off: "),
                                                     testing::HasSubstr("map.exr: ")));
  EXPECT_EQ(waits, 1);
}

// The mesh has become a folder: that is said, and not that files change.
TEST_F(ExecuteTest, AFileThatCannotBeLookedAtIsSaid) {
  const std::string document = make_job_document(job_).value();
  const std::string loop = folder_ + "tetrahedron.off";
  std::filesystem::remove(loop);
  std::filesystem::create_symlink(loop, loop);
  AssetShelf shelf;
  const Result<LoadedJobPtr> loaded = load_job_document({digest_of(document), document}, {}, shelf);
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(loaded.error().message, loop + ": is a loop of links, expected a file");
}

// Of several faults those stay that no second look mends. No file system takes such a name.
TEST_F(ExecuteTest, AMeshThatCannotBeReadIsNoBadInput) {
  JobSpec job = loaded_->context->job;
  job.scene.meshes["tetrahedron"].path = folder_ + std::string(300, 'x') + ".off";
  const auto unread = load_scene(job);
  ASSERT_FALSE(unread);
  EXPECT_EQ(unread.error().kind, ErrorKind::io);
  EXPECT_THAT(unread.error().message, testing::HasSubstr("File name too long"));
  for (const char* const name : {"a", "z"}) {
    job.scene.meshes[name] = {.path = folder_ + "wrong.off"};
    ASSERT_TRUE(write_file_atomic(folder_ + "wrong.off", as_bytes_view("OFF\n")));
    const auto wrong = load_scene(job);
    ASSERT_FALSE(wrong);
    EXPECT_EQ(wrong.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(wrong.error().message, testing::AllOf(testing::HasSubstr("wrong.off"),
                                                      testing::HasSubstr("File name too long")));
    job.scene.meshes.erase(name);
  }
}

TEST_F(ExecuteTest, TasksThatTheJobDoesNotHaveAreBadInput) {
  for (const TaskKey& task : {TaskKey{TaskKind::render, 3, 0}, TaskKey{TaskKind::render, 0, 6},
                              TaskKey{TaskKind::render, -1, 0}, TaskKey{TaskKind::assemble, 5, 0},
                              TaskKey{TaskKind::assemble, 0, 0}}) {
    const Result<TaskResult> output =
        execute(task, {}, {Step(2 * task.position), Step(2 * task.position)});
    ASSERT_FALSE(output);
    EXPECT_EQ(output.error().kind, ErrorKind::bad_input);
  }
}

TEST_F(ExecuteTest, AFrameNeedsEveryTileOnce) {
  auto films = render_all()[Step(0)];
  films[1] = films[0];
  EXPECT_FALSE(execute({TaskKind::assemble, 0, 0}, films));
}

TEST_F(ExecuteTest, AStoppedTaskIsCancelled) {
  std::stop_source stop;
  stop.request_stop();
  const Result<TaskResult> output =
      execute({TaskKind::render, 0, 0}, {}, steps_of(baton::Run(0)), false, {}, stop.get_token());
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().kind, ErrorKind::cancelled);
}

// A worker with too little memory says how much there is; another one may have more.
TEST_F(ExecuteTest, AJobThatDoesNotFitIntoMemoryIsRefusedWithTheNumbers) {
  const std::string document = make_job_document(job_).value();
  const auto load_with = [&](std::uint64_t bytes) {
    AssetShelf shelf;
    Machine machine;
    machine.memory = MemoryBudget::of(bytes);
    return load_job_document({digest_of(document), document}, machine, shelf);
  };
  EXPECT_TRUE(load_with(std::uint64_t{64} << 20));
  const Result<LoadedJobPtr> no_frame = load_with(1 << 10);
  ASSERT_FALSE(no_frame);
  EXPECT_EQ(no_frame.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(no_frame.error().message, testing::HasSubstr("tiles in work and a frame take"));

  // Room for the frame is found at some size; for the ray tracer it is not yet.
  std::uint64_t bytes = 1 << 10;
  Result<LoadedJobPtr> no_scene = load_with(bytes);
  while (!no_scene && no_scene.error().message == no_frame.error().message)
    no_scene = load_with(bytes += 1 << 11);
  ASSERT_FALSE(no_scene);
  EXPECT_THAT(no_scene.error().message, testing::HasSubstr("the scene does not fit into memory"));
}

TEST_F(ExecuteTest, AnAssetThatChangedSinceSubmissionIsNamed) {
  const std::string document = make_job_document(job_).value();
  ASSERT_TRUE(write_file_atomic(folder_ + "tetrahedron.off", as_bytes_view("OFF\n")));
  AssetShelf shelf;
  const Result<LoadedJobPtr> loaded = load_job_document({digest_of(document), document}, {}, shelf);
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().message, testing::HasSubstr("tetrahedron.off"));
}

TEST_F(ExecuteTest, AReplayMakesTheFarmsTile) {
  const std::string path = folder_ + "job.json";
  ASSERT_TRUE(write_file_atomic(path, as_bytes_view(to_json(job_))));
  const ReplayOptions options{.job = path,
                              .frame_number = 4,
                              .tile = 2,
                              .pixel = PixelPosition{35, 3},
                              .out = folder_ + "tile.exr"};
  const Result<std::string> report = replay_tile(options);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_THAT(*report, testing::HasSubstr("particle 15:"));

  // Tile 2 covers x in [32, 40), y in [0, 16).
  const FilmTile tile = read_exr(options.out).value();
  const FilmTile expected = render_in_process().at(Step(3));
  ASSERT_EQ(tile.rect, (PixelRect{0, 0, 8, 16}));
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 8; ++x)
      EXPECT_EQ(tile.find("R")[y * 8 + x], expected.plane(0)[y * 40 + 32 + x]);
  }
}

TEST_F(ExecuteTest, AReplayOfAMovingCorrelatedTileFindsItsHistory) {
  job_.scene.objects[0].keys = {{.frame = 1}, {.frame = 5, .translate = Vec3{0.4f, 0.5f, 0}}};
  job_.motion.max_px = 4;
  job_.visibility.correlated = true;
  const std::string path = folder_ + "job.json";
  ASSERT_TRUE(write_file_atomic(path, as_bytes_view(to_json(job_))));
  const ReplayOptions options{
      .job = path, .frame_number = 3, .tile = 1, .pixel = {}, .out = folder_ + "tile.exr"};
  const Result<std::string> report = replay_tile(options);
  ASSERT_TRUE(report) << report.error().message;
  EXPECT_EQ(read_exr(options.out)->rect, (PixelRect{0, 0, 16, 16}));
}

TEST_F(ExecuteTest, AReplayOfWhatTheJobDoesNotHaveSaysWhatThereIs) {
  const std::string path = folder_ + "job.json";
  ASSERT_TRUE(write_file_atomic(path, as_bytes_view(to_json(job_))));
  EXPECT_THAT(replay_tile({.job = path, .frame_number = 9, .tile = 0, .pixel = {}, .out = {}})
                  .error()
                  .message,
              testing::HasSubstr("1 to 5"));
  EXPECT_THAT(replay_tile({.job = path, .frame_number = 1, .tile = 6, .pixel = {}, .out = {}})
                  .error()
                  .message,
              testing::HasSubstr("[0, 5]"));
  EXPECT_THAT(
      replay_tile(
          {.job = path, .frame_number = 1, .tile = 0, .pixel = PixelPosition{16, 0}, .out = {}})
          .error()
          .message,
      testing::HasSubstr("x in [0, 15]"));
}

TEST_F(ExecuteTest, AnAssemblyReplacesNeitherAPictureOfOthersNorALockedFrame) {
  const auto films = render_all();
  const std::filesystem::path frame = frame_path(job_, FrameIndex(1));
  const FilmTile other{.rect = {0, 0, 2, 2}, .channels = {"Y"}, .values = {1, 2, 3, 4}};
  ASSERT_TRUE(write_exr(frame.string(), other, {.display_window = other.rect}));
  const Bytes bytes = read_file(frame, 1 << 20).value();

  // It stays until the coordinator lets it go.
  Grant grant{.lease = {.job = loaded_->digest, .task = assemble_task(FrameIndex(1))},
              .inputs = films.at(Step(1)),
              .steps = {}};
  Result<TaskResult> output = execute_task(*loaded_, store_.value(), grant, {});
  ASSERT_TRUE(output) << output.error().message;
  ASSERT_TRUE(output->in_place);
  EXPECT_EQ(output->in_place->digest, digest_of(bytes));
  EXPECT_TRUE(output->made.outputs.empty());
  EXPECT_EQ(read_file(frame, 1 << 20).value(), bytes);

  // The mark says whether a frame is locked meanwhile.
  grant.may_replace = {digest_of(bytes)};
  LoadedJob marked = *loaded_;
  marked.token = "token";
  const std::filesystem::path mark = output_token_file(job_.output.directory, marked.digest);
  ASSERT_TRUE(write_token(mark, marked.token, "2,4-5"));
  output = execute_task(marked, store_.value(), grant, {});
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().kind, ErrorKind::cancelled);
  EXPECT_EQ(read_file(frame, 1 << 20).value(), bytes);
  ASSERT_TRUE(write_token(mark, marked.token, "1,3-5"));
  output = execute_task(marked, store_.value(), grant, {});
  ASSERT_TRUE(output) << output.error().message;
  EXPECT_EQ(output->made.outputs.size(), 1u);
  EXPECT_NE(read_file(frame, 1 << 20).value(), bytes);
}

}  // namespace
}  // namespace baton
