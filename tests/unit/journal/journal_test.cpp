#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "common/base/files.h"
#include "coordinator/journal/database.h"
#include "coordinator/journal/journal.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const Digest kJob = digest_of("job");

Completion completion(std::int32_t tile) {
  Completion c{{TaskKind::render, 3, tile},
               {{{BlobKind::film, 7, tile, {1, 2}, 99}, {BlobKind::state, 7, tile, {3, 4}, 5}}}};
  c.made.stats.rays_shadow = 1000;
  c.made.stats.cpu_seconds = 0.125;
  c.made.frames = {{7, tile, {}}};
  c.made.frames[0].sampling.ess_histogram[3] = 5;
  return c;
}

struct JournalTest : testing::Test {
  fs::path folder =
      fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name();
  fs::path path = folder / "journal.sqlite";

  void SetUp() override {
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }

  Journal open() {
    Result<Journal> journal = Journal::open(path);
    EXPECT_TRUE(journal.ok());
    return std::move(journal).value();
  }
  /// What a machine would find after the process was killed right now.
  void kill_and_copy() {
    const fs::path crashed = folder / "crashed.sqlite";
    fs::copy_file(path, crashed, fs::copy_options::overwrite_existing);
    fs::copy_file(path.string() + "-wal", crashed.string() + "-wal",
                  fs::copy_options::overwrite_existing);
    path = crashed;
  }
};

TEST_F(JournalTest, EveryStartIsCounted) {
  EXPECT_EQ(open().epoch(), 1u);
  EXPECT_EQ(open().epoch(), 2u);
}

// Once granted, a frame may be there, whatever becomes of its job, until it is known not to be.
TEST_F(JournalTest, WhatWasGrantedIsKnownInTheArchiveAndAfterABeginning) {
  Journal journal = open();
  ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
  for (const int frame : {0, 1})
    ASSERT_TRUE(journal.record_frame_file(kJob, FrameIndex(frame), FrameFile{}).ok());
  ASSERT_TRUE(
      journal.record_frame_file(kJob, FrameIndex(1), FrameFile{digest_of("1"), {1, 2, 3}}).ok());
  ASSERT_TRUE(journal.archive_job(kJob, {std::byte{1}}, {std::byte{2}}, {}).ok());
  for (const bool begins_again : {false, true}) {
    if (begins_again) {
      ASSERT_TRUE(journal.restart_job(kJob).ok());
    }
    const auto files = journal.frame_files(kJob).value();
    ASSERT_EQ(files.size(), 2u);
    EXPECT_EQ(files.at(FrameIndex(1)).digest, Digest()) << "how it stands is forgotten";
  }
  ASSERT_TRUE(journal.record_frame_file(kJob, FrameIndex(1), std::nullopt).ok());
  EXPECT_EQ(journal.frame_files(kJob).value().size(), 1u);
}

// More than go into one piece of the archive.
TEST_F(JournalTest, AJobOfManyTasksIsArchivedOnce) {
  constexpr std::int32_t kTiles = 9000;
  Journal journal = open();
  ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
  for (std::int32_t tile = 0; tile < kTiles; ++tile)
    ASSERT_TRUE(journal.record_completion(kJob, completion(tile)).ok());
  ASSERT_TRUE(journal.archive_job(kJob, {std::byte{1}}, {std::byte{2}}, {}).ok());
  std::int32_t next = 0;
  const Status visited = journal.for_each_completion(kJob, [&](const Completion& c) -> Status {
    EXPECT_EQ(c.task.tile, next++);
    return next <= kTiles ? Status() : Error{ErrorKind::internal, "more than there were"};
  });
  EXPECT_TRUE(visited.ok());
  EXPECT_EQ(next, kTiles);
}

TEST_F(JournalTest, WhatWasCommittedIsThereAgain) {
  const Failure failure{
      {kJob, {TaskKind::assemble, 2, 0}, 4, 1}, "worker \xc3\xa4", "disk full", true};
  {
    Journal journal = open();
    ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
    ASSERT_TRUE(journal.add_job(digest_of("second"), "[]").ok());
    ASSERT_TRUE(journal.record_completion(kJob, completion(1)).ok());
    ASSERT_TRUE(journal.record_completion(kJob, completion(0)).ok());
    ASSERT_TRUE(journal.record_failure(failure).ok());
    ASSERT_TRUE(journal.record_status(kJob, JobStatus::failed).ok());
    ASSERT_TRUE(journal.commit().ok());
  }

  Journal journal = open();
  EXPECT_EQ(journal.jobs().value(), (std::vector{kJob, digest_of("second")}));
  const JournalledJob job = journal.load(kJob).value();
  EXPECT_EQ(job.document, "{}");
  EXPECT_EQ(job.status, JobStatus::failed);
  Completions expected;
  for (const int i : {1, 0}) expected.add(completion(i));
  ASSERT_EQ(job.completions.tasks.size(), 2u);
  EXPECT_EQ(job.completions.tasks[0].task, completion(1).task);
  EXPECT_EQ(job.completions.tasks[0].outputs, completion(1).made.outputs);
  EXPECT_EQ(job.completions.stats, expected.stats);
  EXPECT_EQ(job.completions.frames, expected.frames);
  EXPECT_EQ(job.completions.steps, expected.steps);
  EXPECT_EQ(journal.run_stats(kJob, baton::Run(3)).value().size(), 2u);
  EXPECT_TRUE(journal.run_stats(kJob, baton::Run(2)).value().empty());
  EXPECT_FALSE(journal.frame_stats(kJob, FrameIndex(3)).value());
  ASSERT_EQ(job.failures.size(), 1u);
  EXPECT_EQ(job.failures[0].lease, failure.lease);
  EXPECT_EQ(job.failures[0].worker, failure.worker);
  EXPECT_TRUE(job.failures[0].permanent);
}

TEST_F(JournalTest, AKilledProcessLosesExactlyWhatItDidNotCommit) {
  Journal journal = open();
  ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
  ASSERT_TRUE(journal.record_completion(kJob, completion(0)).ok());
  ASSERT_TRUE(journal.commit().ok());
  ASSERT_TRUE(journal.record_completion(kJob, completion(1)).ok());
  kill_and_copy();
  EXPECT_EQ(open().load(kJob).value().completions.tasks.size(), 1u);
}

TEST_F(JournalTest, ARestartedJobBeginsWithNothing) {
  Journal journal = open();
  ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
  ASSERT_TRUE(journal.record_completion(kJob, completion(0)).ok());
  ASSERT_TRUE(journal.record_failure({{kJob, {}, 1, 1}, "w", "boom", false}).ok());
  ASSERT_TRUE(journal.record_status(kJob, JobStatus::cancelled).ok());

  ASSERT_TRUE(journal.restart_job(kJob).ok());
  JournalledJob job = journal.load(kJob).value();
  EXPECT_EQ(job.status, JobStatus::running);
  EXPECT_TRUE(job.completions.tasks.empty());
  EXPECT_TRUE(job.failures.empty());
}

// A kind that is read as another one makes a half-done job start from nothing, or fail.
TEST_F(JournalTest, EveryKindOfTaskComesBackAsItWas) {
  Journal journal = open();
  ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
  for (int kind = 0; kind <= static_cast<int>(last_of(TaskKind{})); ++kind) {
    Completion one = completion(kind);
    one.task.kind = static_cast<TaskKind>(kind);
    ASSERT_TRUE(journal.record_completion(kJob, one).ok());
  }
  const auto read = journal.load(kJob).value().completions.tasks;
  ASSERT_EQ(read.size(), static_cast<std::size_t>(last_of(TaskKind{})) + 1);
  for (std::size_t kind = 0; kind < read.size(); ++kind)
    EXPECT_EQ(read[kind].task.kind, static_cast<TaskKind>(kind));
}

TEST_F(JournalTest, TasksThatAreOpenAgainAreNotDone) {
  Journal journal = open();
  ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
  for (const std::int32_t tile : {0, 1, 2})
    ASSERT_TRUE(journal.record_completion(kJob, completion(tile)).ok());
  ASSERT_TRUE(journal.record_reopened(kJob, {completion(0).task, completion(2).task}).ok());
  const auto left = journal.load(kJob).value().completions.tasks;
  ASSERT_EQ(left.size(), 1u);
  EXPECT_EQ(left[0].task, completion(1).task);
}

TEST_F(JournalTest, DocumentsAndFailuresCanBeLookedUp) {
  Journal journal = open();
  ASSERT_TRUE(journal.add_job(kJob, std::string(100000, 'x')).ok());
  for (const char* message : {"one", "two", "three"}) {
    ASSERT_TRUE(journal.record_failure({{kJob, {}, 1, 1}, "w", message, false}).ok());
  }
  EXPECT_EQ(journal.document(kJob).value()->size(), 100000u);
  EXPECT_FALSE(journal.document(digest_of("other")).value().has_value());
  const std::vector<Failure> recent = journal.recent_failures(kJob, 2).value();
  ASSERT_EQ(recent.size(), 2u);
  EXPECT_EQ(recent[0].message, "two");
  EXPECT_EQ(recent[1].message, "three");
}

TEST_F(JournalTest, ASecondCoordinatorIsTurnedAway) {
  const Journal journal = open();
  const Result<Journal> second = Journal::open(path);
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().message,
              HasSubstr("journal.sqlite: already in use by another coordinator"));
}

// What it would hold from then on nobody would read.
TEST_F(JournalTest, OneThatIsDeletedOrReplacedWhileItIsOpenTakesNothingMore) {
  for (const bool is_replaced : {false, true}) {
    Journal journal = open();
    ASSERT_TRUE(journal.add_job(digest_of(is_replaced ? "b" : "a"), "{}").ok());
    ASSERT_TRUE(journal.commit().ok());
    fs::rename(path, folder / "elsewhere");  // still there, and so is what it takes
    ASSERT_TRUE(journal.add_job(digest_of(is_replaced ? "d" : "c"), "{}").ok());
    EXPECT_TRUE(journal.commit().ok());
    if (is_replaced) {
      std::ofstream(folder / "other") << "other";
      fs::rename(folder / "other", folder / "elsewhere");
    } else {
      fs::remove(folder / "elsewhere");
    }
    ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
    const Status committed = journal.commit();
    ASSERT_FALSE(committed.ok());
    EXPECT_THAT(committed.error().message,
                HasSubstr("journal.sqlite: was deleted or replaced while it was open"));
    for (const auto& file : fs::directory_iterator(folder)) fs::remove(file);
  }
}

// One that was killed a moment ago still has the lock.
TEST_F(JournalTest, ACoordinatorOnItsWayOutIsWaitedFor) {
  auto first = std::make_unique<Journal>(open());
  std::jthread end([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    first.reset();
  });
  EXPECT_TRUE(Journal::open(path).ok());
}

TEST_F(JournalTest, ANewerJournalIsRefused) {
  { open(); }
  { ASSERT_TRUE(SqlDatabase::open(path).value().execute("PRAGMA user_version = 10").ok()); }
  const Result<Journal> journal = Journal::open(path);
  ASSERT_FALSE(journal.ok());
  EXPECT_EQ(journal.error().kind, ErrorKind::version);
  EXPECT_THAT(journal.error().message, HasSubstr("journal version 10, this program reads 9"));
}

TEST_F(JournalTest, AnotherProgramsDatabaseIsRefused) {
  { ASSERT_TRUE(SqlDatabase::open(path).value().execute("CREATE TABLE songs (title TEXT)").ok()); }
  EXPECT_EQ(Journal::open(path).error().kind, ErrorKind::corrupt);
}

TEST_F(JournalTest, RubbishIsRefused) {
  std::ofstream(path) << std::string(8192, 'z');
  const Result<Journal> journal = Journal::open(path);
  ASSERT_FALSE(journal.ok());
  EXPECT_EQ(journal.error().kind, ErrorKind::corrupt);
}

TEST_F(JournalTest, ADamagedPageIsNoticed) {
  {
    Journal journal = open();
    ASSERT_TRUE(journal.add_job(kJob, std::string(200000, 'x')).ok());
    for (int i = 0; i < 2000; ++i) ASSERT_TRUE(journal.record_completion(kJob, completion(i)).ok());
    ASSERT_TRUE(journal.commit().ok());
  }
  const auto size = static_cast<std::streamoff>(fs::file_size(path));
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  for (std::streamoff at = 4096; at + 8 < size; at += 4096) {
    file.seekp(at);
    file.write("damaged!", 8);
  }
  file.close();
  EXPECT_EQ(Journal::open(path).error().kind, ErrorKind::corrupt);
}

TEST_F(JournalTest, AMissingFolderIsAnErrorThatNamesTheFile) {
  const Result<Journal> journal = Journal::open(folder / "nowhere" / "journal.sqlite");
  ASSERT_FALSE(journal.ok());
  EXPECT_THAT(journal.error().message, HasSubstr("nowhere/journal.sqlite"));
}

// What several jobs keep is counted once.
TEST_F(JournalTest, CountsTheBytesThatTheArchiveKeeps) {
  Journal journal = open();
  const BlobRef shared{BlobKind::state, 3, 0, {1, 2}, 100}, own{BlobKind::state, 3, 1, {3, 4}, 7};
  const Digest a = digest_of("a"), b = digest_of("b");
  const Bytes text{std::byte{1}};
  for (const Digest& job : {a, b}) ASSERT_TRUE(journal.add_job(job, "{}").ok());
  EXPECT_EQ(*journal.kept_bytes(), 0u);
  ASSERT_TRUE(journal.archive_job(a, text, text, {shared, shared, own}).ok());
  ASSERT_TRUE(journal.archive_job(b, text, text, {shared}).ok());
  EXPECT_EQ(*journal.kept_bytes(), 107u);
  ASSERT_TRUE(journal.let_go(a, shared.digest).ok());
  EXPECT_EQ(*journal.kept_bytes(), 107u);
  ASSERT_TRUE(journal.delete_job(b).ok());
  EXPECT_EQ(*journal.kept_bytes(), 7u);
  ASSERT_TRUE(journal.restart_job(a).ok());
  EXPECT_EQ(*journal.kept_bytes(), 0u);
}

// A journal of this version may come from a program that had no such tables.
TEST_F(JournalTest, TablesThatCameLaterAreMadeWhenTheyAreMissing) {
  {
    Journal journal = open();
    ASSERT_TRUE(journal.add_job(kJob, "{}").ok());
    ASSERT_TRUE(journal.commit().ok());
  }
  {
    SqlDatabase database = SqlDatabase::open(path).value();
    for (const char* const table : {"frame_files", "output_marks"})
      ASSERT_TRUE(database.execute(std::string("DROP TABLE ") + table).ok());
  }
  const FrameIndex frame(3);
  const FrameFile file{digest_of("frame"), {100, 7, 123456789}};
  {
    Journal journal = open();
    EXPECT_EQ(journal.jobs().value().size(), 1u) << "the job goes on";
    EXPECT_TRUE(journal.frame_files(kJob).value().empty());
    ASSERT_TRUE(journal.record_frame_file(kJob, frame, FrameFile{digest_of("old"), {}}).ok());
    ASSERT_TRUE(journal.record_frame_file(kJob, frame, file).ok());
    ASSERT_TRUE(journal.record_output_mark(kJob, "/frames").ok());
    ASSERT_TRUE(journal.commit().ok());
  }
  Journal journal = open();
  const auto files = journal.frame_files(kJob).value();
  ASSERT_EQ(files.size(), 1u);
  EXPECT_EQ(files.at(frame).digest, file.digest);
  EXPECT_EQ(files.at(frame).stamp, file.stamp);
  EXPECT_EQ(journal.output_marks().value(), std::set<Digest>{kJob});
  ASSERT_TRUE(journal.delete_job(kJob).ok());
  EXPECT_TRUE(journal.frame_files(kJob).value().empty());
  EXPECT_TRUE(journal.output_marks().value().empty());
}

}  // namespace
}  // namespace baton
