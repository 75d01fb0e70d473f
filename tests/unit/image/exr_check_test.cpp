#include "common/image/exr_check.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/base/files.h"
#include "common/image/image_io.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

struct ExrCheckTest : testing::Test {
  fs::path file = fs::path(testing::TempDir()) / "exr_check.exr";
  Bytes bytes;

  void SetUp() override {
    FilmTile image{.rect = {0, 0, 32, 40}, .channels = {"B", "G", "R"}, .values = {}};
    for (std::size_t i = 0; i < 3 * image.num_pixels(); ++i)
      image.values.push_back(static_cast<float>(i % 37) / 8);
    bytes = encode_exr("test", image, {.metadata = {{"baton:jobDigest", "0123"}}}).value();
    write(bytes);
  }
  void TearDown() override { fs::remove(file); }
  void write(ByteView content) const { ASSERT_TRUE(write_file_atomic(file, content).ok()); }
  std::optional<std::string> text() const { return text_of_whole_exr(file, "baton:jobDigest"); }
};

TEST_F(ExrCheckTest, AWholeFileSaysWhoWroteIt) {
  EXPECT_EQ(text(), "0123");
  EXPECT_EQ(text_of_whole_exr(file, "other"), "");
}

TEST_F(ExrCheckTest, WhatIsCutOrNoExrIsNone) {
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{3}, bytes.size() / 2, bytes.size() - 1}) {
    write(ByteView(bytes).first(size));
    EXPECT_EQ(text(), std::nullopt) << size;
  }
  write(as_bytes_view(std::string_view("no picture at all")));
  EXPECT_EQ(text(), std::nullopt);
  fs::remove(file);
  EXPECT_EQ(text(), std::nullopt);
}

// Packed pixels have a checksum: nearly every changed byte of them is found.
TEST_F(ExrCheckTest, DamagedPixelsAreFound) {
  std::size_t num_found = 0, num_tried = 0;
  for (std::size_t at = bytes.size() / 2; at < bytes.size(); at += 7, ++num_tried) {
    Bytes damaged = bytes;
    damaged[at] ^= std::byte{0x10};
    write(damaged);
    num_found += text() ? 0 : 1;
  }
  EXPECT_GT(num_found, num_tried * 9 / 10) << "of " << num_tried;
}

}  // namespace
}  // namespace baton
