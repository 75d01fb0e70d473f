#include "worker/run/execute.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "common/base/limits.h"
#include "common/store/folder_token.h"
#include "tests/support/lent_threads.h"
#include "tests/support/log_listener.h"
#include "tests/unit/run/execute_fixture.h"
#include "worker/run/frame_output.h"
#include "worker/run/replay.h"

namespace baton {
namespace {

using namespace testing_run;

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

TEST_F(ExecuteTest, AnAssemblyIsTheSameWhoeverHelps) {
  const auto films = render_all();
  const auto& [step, inputs] = *films.rbegin();
  ASSERT_GT(inputs.size(), 1u);
  const FrameIndex frame = Timeline(job_).frame_of(step);
  const TaskResult alone = execute(assemble_task(frame), inputs).value();
  const Grant grant{.lease = {.job = loaded_->digest, .task = assemble_task(frame)},
                    .inputs = inputs};
  LentThreads others;
  const auto assemble = [&] {
    return execute_task(*loaded_, store_.value(), grant, {}, nullptr, others.lend());
  };
  const TaskResult shared = assemble().value();
  EXPECT_GT(others.join(), 1u);
  EXPECT_EQ(shared.made.outputs, alone.made.outputs);
  ASSERT_EQ(shared.made.frames.size(), 1u);
  EXPECT_EQ(shared.made.frames[0].quality.noise, alone.made.frames[0].quality.noise);
  EXPECT_EQ(shared.made.frames[0].quality.mean, alone.made.frames[0].quality.mean);
  // What one of them does not find is an error of the whole.
  ASSERT_TRUE(store_.value().remove(inputs.back().digest));
  const Result<TaskResult> without = assemble();
  ASSERT_FALSE(without);
  EXPECT_THAT(without.error().message, testing::HasSubstr(inputs.back().digest.hex().substr(2)));
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
  const std::filesystem::path mark =
      output_token_file(job_.output.directory, marked.digest, marked.token);
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
