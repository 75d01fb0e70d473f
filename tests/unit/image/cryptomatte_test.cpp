#include "common/image/cryptomatte.h"

#include <gtest/gtest.h>

#include <bit>

namespace baton {
namespace {

const std::vector<std::string> kChannels{"Id00.R", "Id00.G", "Id00.B", "Id00.A"};

std::uint32_t bits(const char* name) { return std::bit_cast<std::uint32_t>(cryptomatte_id(name)); }

// Known values of MurmurHash3, x86, 32 bits, seed 0.
TEST(Cryptomatte, IdsAreThePublishedHashes) {
  EXPECT_EQ(bits("hello"), 0x248bfa47u);
  EXPECT_EQ(bits("Hello, world!"), 0xc0363e43u);
  EXPECT_EQ(bits("test"), 0xba6bd213u);
  // An exponent of all zeros or ones is no normal float: its last bit is flipped.
  EXPECT_EQ(bits(""), 0x00800000u);
}

FilmTile film_of(std::size_t pixels) {
  FilmTile film{.rect = {0, 0, static_cast<int>(pixels), 1}, .channels = kChannels, .values = {}};
  film.values.resize(4 * pixels);
  return film;
}

TEST(Cryptomatte, KeepsTheLargestShares) {
  FilmTile film = film_of(1);
  std::vector<CryptoShare> shares{{3, 0.2f}, {1, 0.5f}, {2, 0.3f}};
  CryptoLayer(film, kChannels).write(0, shares);
  EXPECT_EQ(film.values, (std::vector<float>{1, 0.5f, 2, 0.3f}));
}

TEST(Cryptomatte, AMeanJoinsWhatIsTheSameThing) {
  FilmTile earlier = film_of(2), film = film_of(2);
  std::vector<CryptoShare> before{{7, 0.75f}, {8, 0.25f}}, now{{8, 1}}, none;
  CryptoLayer(earlier, kChannels).write(0, before);
  CryptoLayer(film, kChannels).write(0, now);
  CryptoLayer(film, kChannels).write(1, now);
  merge_cryptomatte(earlier, 3, kChannels, film);
  // (3 * 0.75, 3 * 0.25 + 1) / 4; the other pixel had nothing before.
  EXPECT_FLOAT_EQ(film.find("Id00.R")[0], 7);
  EXPECT_FLOAT_EQ(film.find("Id00.G")[0], 0.5625f);
  EXPECT_FLOAT_EQ(film.find("Id00.B")[0], 8);
  EXPECT_FLOAT_EQ(film.find("Id00.A")[0], 0.4375f);
  EXPECT_FLOAT_EQ(film.find("Id00.G")[1], 0.25f);
  EXPECT_EQ(film.find("Id00.A")[1], 0);
}

TEST(Cryptomatte, TheManifestNamesWhatThereIs) {
  const ImageMetadata metadata = cryptomatte_metadata("hello", {"a", "b\"c"});
  ASSERT_EQ(metadata.size(), 4u);
  EXPECT_EQ(metadata[0],
            (std::pair<std::string, std::string>{"cryptomatte/248bfa4/name", "hello"}));
  EXPECT_EQ(metadata[3].first, "cryptomatte/248bfa4/manifest");
  EXPECT_EQ(metadata[3].second.substr(0, 6), "{\"a\":\"");
  EXPECT_NE(metadata[3].second.find(",\"b\\\"c\":\""), std::string::npos);
}

}  // namespace
}  // namespace baton
