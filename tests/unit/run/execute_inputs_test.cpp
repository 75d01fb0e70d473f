// Inputs of tasks and files of jobs that are late, away for a moment, or wrong.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "tests/support/log_listener.h"
#include "tests/unit/run/execute_fixture.h"

namespace baton {
namespace {

using namespace testing_run;

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
    return load_shared_assets(job, memory, most, FilesBeside::listed);
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

}  // namespace
}  // namespace baton
