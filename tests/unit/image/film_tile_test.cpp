#include "common/image/film_tile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <set>

#include "common/base/section_file.h"

namespace baton {
namespace {

using testing::HasSubstr;

constexpr SectionTag kMagic{'B', 'T', 'F', '1'};
const FilmOrigin kOrigin{digest_of("job"), Step(7), FilmPass::second};

FilmTile small_tile() {
  return {{4, 8, 6, 9},
          {"R", "normal.X"},
          {0.5f, -0.0f, std::numeric_limits<float>::infinity(), 1e-40f}};
}

/// The error of a small tile whose META starts with other numbers: 4 sides, number of channels.
std::string meta_error(std::size_t index, std::int32_t value) {
  SectionFile file =
      *decode_section_file(encode_film_tile(small_tile(), kOrigin), kMagic, 2, "t.btf");
  std::memcpy(file.sections[0].payload.data() + index * sizeof(value), &value, sizeof(value));
  const Result<StoredFilm> decoded = decode_film_tile(encode_section_file(file), "t.btf");
  return decoded ? "" : decoded.error().message;
}

TEST(FilmTile, ATileThatDoesNotBelongIsNotPasted) {
  const auto tile = [](const PixelRect& rect, std::vector<std::string> channels) {
    FilmTile made = blank_image(rect, std::move(channels));
    made.values.assign(made.values.size(), 1);
    return made;
  };
  FilmTile image = blank_image({0, 0, 4, 3}, {"R", "G"});
  EXPECT_TRUE(paste_tile(tile({1, 1, 3, 2}, {"R", "G"}), image).ok());
  const std::vector<float> one{0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0};
  EXPECT_EQ(std::vector<float>(image.plane(0), image.plane(1)), one);
  EXPECT_EQ(std::vector<float>(image.plane(1), image.plane(1) + 12), one);
  const FilmTile before = image;
  EXPECT_FALSE(paste_tile(tile({3, 0, 5, 2}, {"R", "G"}), image).ok());
  EXPECT_FALSE(paste_tile(tile({-1, 0, 2, 2}, {"R", "G"}), image).ok());
  const Status status = paste_tile(tile({0, 0, 2, 2}, {"R", "A"}), image);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, HasSubstr("expected R G"));
  EXPECT_EQ(image, before);
}

TEST(FilmTile, GivesBackTheSameBits) {
  const FilmTile tile = small_tile();
  const Bytes bytes = encode_film_tile(tile, kOrigin);
  const Result<StoredFilm> decoded = decode_film_tile(bytes, "t.btf");
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_TRUE(decoded->film == tile);
  EXPECT_TRUE(decoded->origin == kOrigin);
  EXPECT_EQ(encode_film_tile(decoded->film, decoded->origin), bytes);
}

// The store names blobs by their content: alike pixels of two tasks must not be one blob.
TEST(FilmTile, FilmsThatLookAlikeAreDifferentBlobs) {
  std::set<Digest> digests;
  for (const char* job : {"job", "other"}) {
    for (const Step step : {Step(0), Step(1)}) {
      for (const FilmPass pass : {FilmPass::first, FilmPass::second})
        digests.insert(digest_of(encode_film_tile(small_tile(), {digest_of(job), step, pass})));
    }
  }
  FilmTile beside = small_tile();
  beside.rect = {6, 8, 8, 9};
  digests.insert(digest_of(encode_film_tile(beside, {digest_of("job"), Step(0), FilmPass::first})));
  EXPECT_EQ(digests.size(), 9u);
}

TEST(FilmTile, AnyChangedByteAndAnyTruncationIsAnError) {
  const Bytes good = encode_film_tile(small_tile(), kOrigin);
  for (std::size_t i = 0; i < good.size(); ++i) {
    Bytes bad = good;
    bad[i] ^= std::byte{0x10};
    EXPECT_FALSE(decode_film_tile(bad, "t.btf").ok()) << "byte " << i;
    EXPECT_FALSE(decode_film_tile(ByteView(good).first(i), "t.btf").ok()) << i << " bytes";
  }
}

TEST(FilmTile, MetaMustDescribeThePixels) {
  EXPECT_THAT(meta_error(2, 4), HasSubstr("t.btf: section META has rectangle [4, 4) x [8, 9)"));
  EXPECT_THAT(meta_error(0, -4097), HasSubstr("rectangle [-4097, 6)"));
  EXPECT_THAT(meta_error(2, 7), HasSubstr("section PIXL has 16 bytes, expected 24"));
  EXPECT_THAT(meta_error(4, 0), HasSubstr("has 0 channels, expected 1 to 256"));
  EXPECT_THAT(meta_error(4, 1), HasSubstr("is not a rectangle, a list of names, a job"));
  EXPECT_THAT(meta_error(4, 3), HasSubstr("no name for channel 2"));
  EXPECT_THAT(meta_error(4, -1), HasSubstr("expected 1 to 256"));
}

TEST(FilmTile, ChannelNamesDiffer) {
  FilmTile tile = small_tile();
  tile.channels[1] = "R";
  EXPECT_THAT(decode_film_tile(encode_film_tile(tile, kOrigin), "t.btf").error().message,
              HasSubstr("has channel R twice"));
}

TEST(FilmTile, AStateIsNotAFilm) {
  const Bytes state = encode_section_file({{'B', 'S', 'T', '1'}, 1, {}});
  EXPECT_THAT(decode_film_tile(state, "t.bst").error().message,
              HasSubstr("t.bst: does not start with BTF1"));
}

}  // namespace
}  // namespace baton
