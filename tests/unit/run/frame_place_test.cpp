#include "worker/run/frame_place.h"

#include <gtest/gtest.h>

#include "common/base/files.h"
#include "common/image/film_tile.h"
#include "common/image/frame_seal.h"
#include "common/image/image_io.h"
#include "common/job/job_id.h"
#include "common/store/frame_locks.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

struct FramePlaceTest : testing::Test {
  const fs::path folder = fs::path(testing::TempDir()) / "frame_place";
  const fs::path frame = folder / "beauty.0001.exr";
  const Digest made = digest_of("frame");
  static constexpr JobId kJob{7};

  void SetUp() override {
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  Digest put_picture(float value, const std::string& job) const {
    FilmTile image{.rect = {0, 0, 4, 4}, .channels = {"R", "G", "B"}, .values = {}};
    image.values.assign(3 * image.num_pixels(), value);
    const ImageMetadata metadata{{"baton:jobDigest", job}, {kSealAttribute, blank_seal()}};
    Bytes bytes =
        encode_exr("test", image, {.metadata = metadata, .display_window = image.rect}).value();
    seal_frame(frame.filename().string(), bytes);
    EXPECT_TRUE(write_file_atomic(frame, bytes));
    return digest_of(read_file(frame, 1 << 20).value());
  }
  std::optional<PictureInPlace> find(const std::vector<Digest>& may_replace = {}) const {
    return look_at_place(frame, made, may_replace).value().stays;
  }
};

TEST_F(FramePlaceTest, OnlyAWholePictureOfOthersStays) {
  EXPECT_FALSE(find()) << "nothing is there";
  EXPECT_TRUE(look_at_place(frame, made, {}).value().is_free);
  const Digest there = put_picture(0.5f, "0123");
  ASSERT_TRUE(find());
  EXPECT_EQ(find()->digest, there);
  EXPECT_EQ(find()->writer, "0123");
  EXPECT_TRUE(find({digest_of("another")}));
  EXPECT_FALSE(find({digest_of("another"), there}));
  EXPECT_FALSE(look_at_place(frame, there, {}).value().stays) << "the same bytes";
  EXPECT_FALSE(look_at_place(frame, there, {}).value().is_free);

  fs::resize_file(frame, fs::file_size(frame) / 2);
  EXPECT_FALSE(find()) << "cut";
  ASSERT_TRUE(write_file_atomic(frame, as_bytes_view("no picture")));
  EXPECT_FALSE(find());
}

TEST_F(FramePlaceTest, WhatCannotBeReadIsAnError) {
  fs::create_directories(frame);
  const auto found = look_at_place(frame, made, {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::io) << "it may pass";
}

// Whatever the coordinator says, which may not know the other one, or be a copy of the one that
// knows.
TEST_F(FramePlaceTest, WhatIsLockedStays) {
  const Digest there = put_picture(0.5f, "0123");
  const std::string name = frame.filename().string();
  ASSERT_TRUE(record_locks(folder, kJob.hex(), {{name}}));
  EXPECT_TRUE(find({there})) << "nobody is asked to write what is locked here";
  ASSERT_TRUE(record_locks(folder, JobId{8}.hex(), {{"another.exr", name}}));
  EXPECT_TRUE(find({there}));
  ASSERT_TRUE(record_locks(folder, kJob.hex(), {}));
  EXPECT_TRUE(find({there}));
  ASSERT_TRUE(record_locks(folder, JobId{8}.hex(), {}));
  EXPECT_FALSE(find({there}));
  EXPECT_FALSE(fs::exists(lock_folder(folder)));

  fs::create_directories(lock_folder(folder) / JobId{8}.hex());
  const auto unknown = look_at_place(frame, made, {there});
  ASSERT_FALSE(unknown) << "nothing is replaced while locks cannot be read";
  EXPECT_EQ(unknown.error().kind, ErrorKind::io);
}

// Nobody reads, changes and writes what another one writes at the same time.
TEST_F(FramePlaceTest, LocksOfTwoAreKeptWhoeverWritesMeanwhile) {
  const std::string ids[] = {JobId{7}.hex(), JobId{8}.hex()};
  std::vector<std::thread> writers;
  for (const std::string& id : ids) {
    writers.emplace_back([&, id] {
      for (int i = 0; i < 200; ++i) {
        EXPECT_TRUE(record_locks(folder, id, {}));
        EXPECT_TRUE(record_locks(folder, id, {{id + ".exr"}}));
        EXPECT_TRUE(locks_of_others(folder, "").value().contains(id + ".exr"));
      }
    });
  }
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(locks_of_others(folder, "").value().size(), 2u);
}

// Older programs wrote no time, others end lines with a carriage return.
TEST_F(FramePlaceTest, LocksAreReadAsOthersWriteThem) {
  const FolderLocks locks{{"frame.0001.exr", "frame.0002.exr"}, 1234567890123};
  ASSERT_TRUE(record_locks(folder, "a", locks));
  const fs::path file = lock_folder(folder) / "b";
  ASSERT_TRUE(write_file_atomic(file, as_bytes_view("frame.0003.exr\r\n\r\n")));
  const auto read = locks_by_job(folder).value();
  EXPECT_EQ(read.at("a"), locks);
  EXPECT_EQ(read.at("b"), FolderLocks({"frame.0003.exr"}, 0));
  ASSERT_TRUE(retain_locks(folder, "a", {"frame.0002.exr"}));
  EXPECT_EQ(locks_by_job(folder).value().at("a"), FolderLocks({"frame.0002.exr"}, 1234567890123));
}

TEST_F(FramePlaceTest, NothingIsLockedInAFolderThatIsNotThere) {
  EXPECT_FALSE(record_locks(folder / "unmounted", kJob.hex(), {{"frame.exr"}}));
  EXPECT_TRUE(record_locks(folder / "unmounted", kJob.hex(), {}));
  EXPECT_FALSE(fs::exists(folder / "unmounted"));
}

// Nothing is written, or removed, where a link in its place leads.
TEST_F(FramePlaceTest, ALinkInPlaceOfTheLocksIsNotFollowed) {
  ASSERT_TRUE(record_locks(folder, "a", {{"frame.exr"}}));
  const fs::path elsewhere = folder / "elsewhere";
  fs::rename(lock_folder(folder), elsewhere);
  fs::create_directory_symlink(elsewhere, lock_folder(folder));
  EXPECT_FALSE(record_locks(folder, "a", {}));
  EXPECT_FALSE(record_locks(folder, "new", {{"frame.exr"}}));
  EXPECT_TRUE(fs::exists(elsewhere / "a"));
  EXPECT_FALSE(fs::exists(elsewhere / "new"));
}

}  // namespace
}  // namespace baton
