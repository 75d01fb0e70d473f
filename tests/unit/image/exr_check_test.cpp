#include "common/image/exr_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "common/base/files.h"
#include "common/image/frame_seal.h"
#include "common/image/image_io.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

struct ExrCheckTest : testing::Test {
  fs::path file = fs::path(testing::TempDir()) / "exr_check.exr";
  Bytes bytes, unsealed;

  void SetUp() override {
    FilmTile image{.rect = {0, 0, 32, 40}, .channels = {"B", "G", "R"}, .values = {}};
    for (std::size_t i = 0; i < 3 * image.num_pixels(); ++i)
      image.values.push_back(static_cast<float>(i % 37) / 8);
    const ImageMetadata metadata{{"baton:jobDigest", "0123"}, {kSealAttribute, blank_seal()}};
    bytes = encode_exr("test", image, {.metadata = metadata}).value();
    unsealed = bytes;
    seal_frame(file.filename().string(), bytes);
    write(bytes);
  }
  void TearDown() override { fs::remove(file); }
  void write(ByteView content) const { ASSERT_TRUE(write_file_atomic(file, content).ok()); }
  static std::optional<std::string> text_of(const fs::path& path) {
    return writer_of_frame(path.filename().string(), read_file(path, 1 << 20).value());
  }
  std::optional<std::string> text() const { return text_of(file); }
};

TEST_F(ExrCheckTest, AWholeFileSaysWhoWroteIt) {
  EXPECT_EQ(text(), "0123");
  write(unsealed);
  EXPECT_EQ(text(), "");
}

// A painted frame may keep its header, and a copy may lie in another frame's place.
TEST_F(ExrCheckTest, AFrameThatIsNotAsItWasWrittenIsNobodys) {
  const fs::path other = file.parent_path() / "exr_check.other.exr";
  ASSERT_TRUE(write_file_atomic(other, bytes).ok());
  EXPECT_EQ(text_of(other), "");
  fs::remove(other);

  FilmTile image{.rect = {0, 0, 32, 40}, .channels = {"B", "G", "R"}, .values = {}};
  image.values.assign(3 * image.num_pixels(), 1);
  const Bytes sealed = bytes;
  const std::string text_of_all(reinterpret_cast<const char*>(sealed.data()), sealed.size());
  const std::size_t at = text_of_all.find(kSealAttribute) + sizeof(kSealAttribute) + 7 + 4;
  const ImageMetadata metadata{{"baton:jobDigest", "0123"},
                               {kSealAttribute, text_of_all.substr(at, 32)}};
  write(encode_exr("test", image, {.metadata = metadata}).value());
  EXPECT_EQ(text(), "") << "painted, with the header that it had";
}

// The same bytes under the same name, wherever and whenever.
TEST_F(ExrCheckTest, SealsAreThoseOfNameAndBytes) {
  Bytes again = unsealed;
  seal_frame(file.filename().string(), again);
  EXPECT_EQ(again, bytes);
  EXPECT_TRUE(is_sealed(file.filename().string(), bytes));
  EXPECT_FALSE(is_sealed("else.exr", bytes));
  EXPECT_FALSE(is_sealed(file.filename().string(), unsealed));
  EXPECT_FALSE(is_sealed("empty", {}));
  for (std::size_t i = 0; i < bytes.size(); i += 101) {
    Bytes changed = bytes;
    changed[i] ^= std::byte{1};
    EXPECT_FALSE(is_sealed(file.filename().string(), changed)) << i;
  }
}

TEST_F(ExrCheckTest, WhatIsCutOrNoExrIsNone) {
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{3}, bytes.size() / 2, bytes.size() - 1}) {
    write(ByteView(bytes).first(size));
    EXPECT_EQ(text(), std::nullopt) << size;
  }
  write(as_bytes_view(std::string_view("no picture at all")));
  EXPECT_EQ(text(), std::nullopt);
}

// Wider than what is read here, or packed in a way that is not known: nobody can say that it is
// damaged, and it is not a worker's.
TEST_F(ExrCheckTest, WhatIsBeyondTheReaderIsSomebodys) {
  using namespace std::string_view_literals;
  const auto changed = [](Bytes exr, std::string_view key, std::size_t at, std::uint8_t value) {
    const auto found = std::ranges::search(exr, as_bytes_view(key));
    EXPECT_FALSE(found.empty());
    if (!found.empty()) *(found.end() + static_cast<std::ptrdiff_t>(at)) = std::byte{value};
    return exr;
  };
  const FilmTile image{{0, 0, 2, 1}, {"B", "G", "R"}, {1, 2, 3, 4, 5, 6}};
  const Bytes person = encode_exr("test", image, {}).value();
  for (const Bytes& exr : {person, bytes}) {
    const std::optional<std::string> verdict =
        exr == person ? std::optional(std::string()) : std::nullopt;
    write(changed(exr, "dataWindow\0box2i\0\x10\0\0\0"sv, 10, 1));  // x to 65537
    EXPECT_EQ(text(), verdict);
    write(changed(exr, "compression\0compression\0\x01\0\0\0"sv, 0, 200));
    EXPECT_EQ(text(), verdict);
  }
  write(ByteView(changed(person, "compression\0compression\0\x01\0\0\0"sv, 0, 200)).first(100));
  EXPECT_EQ(text(), std::nullopt) << "its header is cut";
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
