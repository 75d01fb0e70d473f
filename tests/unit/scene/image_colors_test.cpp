#include "common/scene/texture/image_colors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "common/image/image_io.h"
#include "tests/support/image_files.h"

namespace baton {
namespace {

using testing::ElementsAre;
using testing::FloatNear;
using testing::HasSubstr;
using testing::Pointwise;

constexpr Chromaticities kAp1{
    {0.713f, 0.293f}, {0.165f, 0.83f}, {0.128f, 0.044f}, {0.32168f, 0.33767f}};

/// An EXR file of one pixel.
std::string exr_of(const std::vector<std::string>& channels, const std::vector<float>& pixel,
                   const Chromaticities& colors = {}) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "colors.exr";
  const FilmTile film{.rect = {0, 0, 1, 1}, .channels = channels, .values = pixel};
  EXPECT_TRUE(write_exr(path, film, {.half_float = false, .chromaticities = colors}));
  return path.string();
}

/// What a material gets of an image.
std::vector<float> settled(Image image, TextureUse use) {
  const Status done = to_linear_colors(image, use, "test.exr");
  EXPECT_TRUE(done) << done.error().message;
  return image.samples;
}

TEST(ImageColors, ChannelsOfExrFilesAreTakenByTheirNames) {
  const struct {
    std::vector<std::string> channels;  // with values 1, 2, 3 ...
    std::vector<float> samples;
    bool has_alpha;
  } cases[] = {{{"R", "G", "B", "A"}, {1, 2, 3, 4}, true},
               {{"A", "B", "G", "R"}, {4, 3, 2, 1}, true},
               {{"R", "G", "B"}, {1, 2, 3}, false},
               {{"R", "G", "B", "depth.Z"}, {1, 2, 3}, false},
               {{"R", "G", "B", "Z"}, {1, 2, 3}, false},
               {{"R", "G", "B", "A", "Z"}, {1, 2, 3, 4}, true},
               {{"R", "G", "B", "mask.A"}, {1, 2, 3}, false},
               {{"R", "G", "B", "N.X", "N.Y", "N.Z"}, {1, 2, 3}, false},
               {{"a.R", "a.G", "a.B", "a.A", "b.R", "b.G", "b.B"}, {1, 2, 3, 4}, true},
               {{"R", "G"}, {1, 2}, false},
               {{"G", "B"}, {0, 1, 2}, false},
               {{"R", "A"}, {1, 2}, true},
               {{"Y", "A"}, {1, 2}, true},
               {{"Y", "Z"}, {1}, false},
               {{"X", "Y", "Z"}, {1, 2, 3}, false},
               {{"A"}, {1}, false}};
  for (const auto& c : cases) {
    std::vector<float> values;
    while (values.size() < c.channels.size())
      values.push_back(static_cast<float>(values.size() + 1));
    const auto image = read_image(exr_of(c.channels, values));
    ASSERT_TRUE(image.ok()) << image.error().message;
    EXPECT_EQ(image->samples, c.samples) << testing::PrintToString(c.channels);
    EXPECT_EQ(image->has_alpha, c.has_alpha) << testing::PrintToString(c.channels);
    EXPECT_EQ(image->is_associated, c.has_alpha) << "by convention";
  }
}

TEST(ImageColors, ThePictureOfAnExrFileIsItsDisplayWindow) {
  const std::filesystem::path path = std::filesystem::path(testing::TempDir()) / "window.exr";
  const FilmTile film{.rect = {-1, 1, 2, 3},
                      .channels = {"R", "A"},
                      .values = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}};
  ASSERT_TRUE(
      write_exr(path, film, {.half_float = false, .display_window = PixelRect{0, 0, 3, 2}}));
  const Image image = read_image(path.string()).value();
  EXPECT_EQ(image.width, 3);
  EXPECT_EQ(image.height, 2);
  EXPECT_THAT(image.samples, ElementsAre(0, 0, 0, 0, 0, 0, 2, 8, 3, 9, 0, 0));
}

TEST(ImageColors, BaseColoursAreDividedByTheAlphaThatTheyAreMultipliedBy) {
  const std::vector<float> pixel{0.1f, 0.2f, 0.05f, 0.25f}, whole{0.4f, 0.8f, 0.2f, 0.25f};
  const Image exr = read_image(exr_of({"R", "G", "B", "A"}, pixel)).value();
  const auto near = [](const std::vector<float>& v) { return Pointwise(FloatNear(1e-6f), v); };
  EXPECT_THAT(settled(exr, TextureUse::color_and_alpha), near(whole));
  EXPECT_THAT(settled(exr, TextureUse::color), near(whole)) << "of an opaque material, too";
  for (const auto use : {TextureUse::light, TextureUse::normal, TextureUse::metallic_roughness})
    EXPECT_EQ(settled(exr, use), pixel) << "radiance and numbers stay";
  const auto tiff = [&](test::TiffExtra extra) {
    return settled(read_image(test::write_tiff("alpha.tif", 1, 1, extra, pixel)).value(),
                   TextureUse::color_and_alpha);
  };
  EXPECT_THAT(tiff(test::TiffExtra::associated), near(whole));
  EXPECT_EQ(tiff(test::TiffExtra::unassociated), pixel);
  // Of nothing no colour is known.
  const Image clear = read_image(exr_of({"R", "G", "B", "A"}, {0.1f, 0, 0, 0})).value();
  EXPECT_THAT(settled(clear, TextureUse::color_and_alpha), ElementsAre(0.1f, 0, 0, 0));
}

TEST(ImageColors, AreConvertedAsThoseOfMapsAre) {
  const std::vector<float> pixel{0.5f, 0.2f, 0.1f, 1};
  const std::string path = exr_of({"R", "G", "B", "A"}, pixel, kAp1);
  const Image image = read_image(path).value();
  std::vector<float> expected = read_rgb_image(path).value().rgb;
  ASSERT_GT(expected[0], 0.6f) << "Rec. 709 is smaller";
  expected.push_back(1);
  for (const auto use : {TextureUse::color, TextureUse::color_and_alpha, TextureUse::light})
    EXPECT_EQ(settled(image, use), expected);
  for (const auto use :
       {TextureUse::normal, TextureUse::metallic_roughness, TextureUse::red, TextureUse::green})
    EXPECT_EQ(settled(image, use), pixel) << "numbers are no colours";
  const Image grey = read_image(exr_of({"Y"}, {0.5f}, kAp1)).value();
  EXPECT_THAT(settled(grey, TextureUse::color), ElementsAre(0.5f));
}

TEST(ImageColors, ChromaticitiesOfNoColourSpaceAreAnErrorWithTheFile) {
  const Chromaticities line{{0.3f, 0.3f}, {0.4f, 0.4f}, {0.5f, 0.5f}, {0.3f, 0.3f}};
  Image image = read_image(exr_of({"R", "G", "B"}, {1, 1, 1}, line)).value();
  const Status done = to_linear_colors(image, TextureUse::color, "tiles.exr");
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("tiles.exr: chromaticities: expected"));
}

}  // namespace
}  // namespace baton
