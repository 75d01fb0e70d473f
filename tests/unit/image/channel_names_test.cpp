#include "common/image/channel_names.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "common/image/exr_channels.h"
#include "common/image/image_io.h"

namespace baton {
namespace {

const std::vector<std::string> kAll{
    "A",         "B",        "G",        "R",          "Z",          "depth",
    "normal.X",  "normal.Y", "normal.Z", "P.X",        "P.Y",        "P.Z",
    "albedo.B",  "albedo.G", "albedo.R", "backward.u", "backward.v", "forward.u",
    "forward.v", "lns",      "material", "object",     "shadow.R",   "CryptoObject00.A"};

TEST(ChannelNames, PlainOnesStay) {
  for (const std::string& name : kAll)
    EXPECT_EQ(stored_channel(name, ChannelNaming::plain), StoredChannel{name});
  for (const PlainChannel& channel : plain_channels(kAll))
    EXPECT_EQ(channel.stored, StoredChannel{channel.name});
}

TEST(ChannelNames, BlendersHaveLayerPassAndChannelAndAreReadBack) {
  std::vector<std::string> stored;
  for (const std::string& name : kAll)
    stored.push_back(stored_channel(name, ChannelNaming::blender).name);
  EXPECT_EQ(std::set(stored.begin(), stored.end()).size(), kAll.size());
  EXPECT_EQ(stored[3], "ViewLayer.Combined.R");
  EXPECT_EQ(stored[4], "ViewLayer.Depth.Z");
  EXPECT_EQ(stored[17], "ViewLayer.Vector.Z");
  EXPECT_EQ(stored[19], "ViewLayer.lns.X");
  EXPECT_EQ(stored[23], "ViewLayer.CryptoObject00.A");
  const std::vector<PlainChannel> again = plain_channels(stored);
  ASSERT_EQ(again.size(), kAll.size());
  for (const std::string& name : kAll) {
    const auto found = std::ranges::find(again, name, &PlainChannel::name);
    ASSERT_NE(found, again.end()) << name;
    EXPECT_EQ(found->stored, stored_channel(name, ChannelNaming::blender));
  }
}

TEST(ChannelNames, OthersKeepTheirs) {
  const auto names = [](const std::vector<std::string>& stored) {
    std::vector<std::string> plain;
    for (const PlainChannel& channel : plain_channels(stored)) plain.push_back(channel.name);
    return plain;
  };
  const std::vector<std::string> mixed{"R", "ViewLayer.Combined.R"};
  EXPECT_EQ(names(mixed), mixed);
  const std::vector<std::string> twice{"ViewLayer.Combined.R", "ViewLayer.R"};
  EXPECT_EQ(names(twice), twice) << "both would be R";
  const std::vector<std::string> nested{"ViewLayer..X", "ViewLayer.ViewLayer.R"};
  EXPECT_EQ(names(nested), nested);
}

TEST(ChannelNames, FilesOfBothNamingsReadAlike) {
  FilmTile film{{0, 0, 3, 2}, kAll, {}};
  for (std::size_t i = 0; i < film.channels.size() * film.num_pixels(); ++i)
    film.values.push_back(static_cast<float>(i));
  const auto path = std::filesystem::path(testing::TempDir()) / "baton_names.exr";
  ASSERT_TRUE(write_exr(path, film, {.half_float = false, .naming = ChannelNaming::blender}).ok());
  const FilmTile read = read_exr(path).value();
  ASSERT_EQ(read.channels.size(), kAll.size());
  for (std::size_t c = 0; c < kAll.size(); ++c) {
    ASSERT_NE(read.find(kAll[c]), nullptr) << kAll[c];
    EXPECT_EQ(read.find(kAll[c])[5], film.plane(c)[5]) << kAll[c];
  }
  EXPECT_EQ(read_rgb_image(path).value().rgb[0], film.plane(3)[0]);
}

}  // namespace
}  // namespace baton
