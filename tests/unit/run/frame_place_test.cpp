#include "worker/run/frame_place.h"

#include <gtest/gtest.h>

#include "common/base/files.h"
#include "common/image/film_tile.h"
#include "common/image/frame_seal.h"
#include "common/image/image_io.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

struct FramePlaceTest : testing::Test {
  const fs::path folder = fs::path(testing::TempDir()) / "frame_place";
  const fs::path frame = folder / "beauty.0001.exr";
  const Digest made = digest_of("frame");

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
    return find_picture_in_place(frame, made, may_replace).value();
  }
};

TEST_F(FramePlaceTest, OnlyAWholePictureOfOthersStays) {
  EXPECT_FALSE(find()) << "nothing is there";
  const Digest there = put_picture(0.5f, "0123");
  ASSERT_TRUE(find());
  EXPECT_EQ(find()->digest, there);
  EXPECT_EQ(find()->writer, "0123");
  EXPECT_TRUE(find({digest_of("another")}));
  EXPECT_FALSE(find({digest_of("another"), there}));
  EXPECT_FALSE(find_picture_in_place(frame, there, {}).value()) << "the same bytes";

  fs::resize_file(frame, fs::file_size(frame) / 2);
  EXPECT_FALSE(find()) << "cut";
  ASSERT_TRUE(write_file_atomic(frame, as_bytes_view("no picture")));
  EXPECT_FALSE(find());
}

TEST_F(FramePlaceTest, WhatCannotBeReadIsAnError) {
  fs::create_directories(frame);
  const auto found = find_picture_in_place(frame, made, {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().kind, ErrorKind::io) << "it may pass";
}

}  // namespace
}  // namespace baton
