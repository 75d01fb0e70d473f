#include "common/image/color_space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/files.h"
#include "common/image/image_io.h"

namespace baton {
namespace {

using testing::HasSubstr;

/// ACEScg [SMPTE ST 2065-1, AP1].
constexpr Chromaticities kAp1{
    {0.713f, 0.293f}, {0.165f, 0.83f}, {0.128f, 0.044f}, {0.32168f, 0.33767f}};

std::filesystem::path scratch(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / ("baton_color_" + name);
}

/// A picture of one pixel in a file that says these chromaticities.
Result<RgbImage> through_exr(const Rgb& color, const Chromaticities& space) {
  const std::filesystem::path path = scratch("a.exr");
  const FilmTile pixel{{0, 0, 1, 1}, {"B", "G", "R"}, {color.z, color.y, color.x}};
  const Status written = write_exr(path, pixel, {.half_float = false, .chromaticities = space});
  EXPECT_TRUE(written.ok());
  return read_rgb_image(path);
}

Result<RgbImage> through_radiance(const std::string& settings) {
  std::string file = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n" + settings + "\n-Y 1 +X 1\n";
  for (const int byte : {128, 64, 32, 129}) file.push_back(static_cast<char>(byte));
  EXPECT_TRUE(write_file_atomic(scratch("a.hdr"), as_bytes_view(file)).ok());
  return read_rgb_image(scratch("a.hdr"));
}

TEST(ColorSpace, OwnPicturesAreTakenAsTheyAre) {
  const Result<RgbImage> read = through_exr({0.1f, 7.3f, 1e-7f}, {});
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->rgb, (std::vector<float>{0.1f, 7.3f, 1e-7f}));
  EXPECT_EQ(conversion_text({}), "");
}

/// Columns of the matrix that OpenColorIO has for ACEScg to linear Rec. 709 (Bradford).
TEST(ColorSpace, AcescgBecomesRec709) {
  const std::vector<std::array<float, 3>> columns{{1.70505f, -0.13026f, -0.02400f},
                                                  {-0.62179f, 1.14080f, -0.12897f},
                                                  {-0.08326f, -0.01055f, 1.15297f}};
  for (std::size_t c = 0; c < 3; ++c) {
    const Result<RgbImage> read =
        through_exr({c == 0 ? 1.0f : 0, c == 1 ? 1.0f : 0, c == 2 ? 1.0f : 0}, kAp1);
    ASSERT_TRUE(read.ok()) << read.error().message;
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(read->rgb[i], columns[c][i], 2e-4);
  }
}

TEST(ColorSpace, WhiteStaysWhite) {
  const Result<RgbImage> read = through_exr({0.5f, 0.5f, 0.5f}, kAp1);
  ASSERT_TRUE(read.ok()) << read.error().message;
  for (const float v : read->rgb) EXPECT_NEAR(v, 0.5f, 1e-5);
}

TEST(ColorSpace, ZerosCountAsUnknown) {
  const Result<RgbImage> exr = through_exr({1, 2, 3}, {{0, 0}, {0, 0}, {0, 0}, {0, 0}});
  ASSERT_TRUE(exr.ok()) << exr.error().message;
  EXPECT_EQ(exr->rgb[2], 3);
  EXPECT_THAT(exr->notes, testing::ElementsAre("chromaticities of 0 count as unknown"));
  for (const char* const line :
       {"EXPOSURE=0", "EXPOSURE= 0.0", "COLORCORR=0 0 0", "PRIMARIES=0 0 0 0 0 0 0 0"}) {
    const Result<RgbImage> read = through_radiance(std::string(line) + "\n");
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_EQ(read->rgb, (std::vector<float>{1, 0.5f, 0.25f})) << line;
    EXPECT_THAT(read->notes, testing::ElementsAre(std::string(line) + " counts as unknown"));
  }
  EXPECT_THAT(through_radiance("EXPOSURE=2\n")->notes, testing::IsEmpty());
}

TEST(ColorSpace, ASpaceThatIsNoneIsAnError) {
  const Result<RgbImage> read =
      through_exr({1, 1, 1}, {{0.3f, 0.3f}, {0.4f, 0.4f}, {0.5f, 0.5f}, {0.3f, 0.3f}});
  ASSERT_FALSE(read.ok());
  EXPECT_THAT(read.error().message, HasSubstr("a.exr: chromaticities: expected those of a color"));
}

TEST(ColorSpace, RadianceExposuresAreUndone) {
  const Result<RgbImage> plain = through_radiance("");
  ASSERT_TRUE(plain.ok()) << plain.error().message;
  EXPECT_EQ(plain->rgb, (std::vector<float>{1, 0.5f, 0.25f}));
  const Result<RgbImage> read =
      through_radiance("EXPOSURE=2\nCOLORCORR= 1 .5 4\nEXPOSURE= 4.0e0\n");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->rgb, (std::vector<float>{1.0f / 8, 0.5f / 4, 0.25f / 32}));
  const Result<ImageColors> colors = read_image_colors(scratch("a.hdr"));
  ASSERT_TRUE(colors.ok());
  EXPECT_EQ(conversion_text(*colors), "divided by its exposure, (8, 4, 32)");
}

TEST(ColorSpace, RadiancePrimariesAreConverted) {
  const Result<RgbImage> same =
      through_radiance("PRIMARIES= 0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329\n");
  ASSERT_TRUE(same.ok()) << same.error().message;
  EXPECT_EQ(same->rgb, (std::vector<float>{1, 0.5f, 0.25f}));
  const Result<RgbImage> other =
      through_radiance("PRIMARIES= 0.713 0.293 0.165 0.83 0.128 0.044 0.32168 0.33767\n");
  ASSERT_TRUE(other.ok()) << other.error().message;
  EXPECT_NEAR(other->rgb[0], 1.70505f - 0.5f * 0.62179f - 0.25f * 0.08326f, 3e-4);
}

TEST(ColorSpace, SettingsThatAreNoneAreErrors) {
  for (const char* const line :
       {"COLORCORR=0 1 1", "EXPOSURE=-1", "EXPOSURE=bright", "COLORCORR=1 2",
        "EXPOSURE=1e-30\nEXPOSURE=1e-30", "PRIMARIES=1 2 3"}) {
    const Result<RgbImage> read = through_radiance(std::string(line) + "\n");
    ASSERT_FALSE(read.ok()) << line;
    EXPECT_THAT(read.error().message, HasSubstr("not a readable Radiance HDR file: a line "))
        << line;
  }
}

}  // namespace
}  // namespace baton
