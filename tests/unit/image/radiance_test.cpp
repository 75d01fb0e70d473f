#include "common/image/radiance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>

namespace baton {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kStart = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n\n";

/// A file of header text and pixel bytes.
Bytes file_of(const std::string& header, std::initializer_list<int> pixels) {
  ByteWriter writer;
  writer.put_raw(as_bytes_view(header));
  for (const int value : pixels) writer.put(static_cast<std::uint8_t>(value));
  return writer.take();
}

Result<RgbImage> read(const Bytes& file) {
  BATON_ASSIGN(const RadianceHeader header, read_radiance_header(file, "a.hdr"));
  return read_radiance_pixels(file, header, "a.hdr");
}

Result<RgbImage> read_rows(const std::string& sides, std::initializer_list<int> pixels) {
  return read(file_of(kStart + sides, pixels));
}

/// Red of every pixel.
std::vector<float> reds(const RgbImage& image) {
  std::vector<float> values;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3) values.push_back(image.rgb[i]);
  return values;
}

TEST(Radiance, PlainPixelsAreMantissasTimesAPowerOfTwo) {
  const auto image = read_rows("-Y 1 +X 3\n", {128, 64, 32, 129, 255, 255, 255, 0, 1, 0, 200, 255});
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_THAT(image->rgb, ElementsAre(1, 0.5f, 0.25f, 0, 0, 0, 0x1p119f, 0, 200 * 0x1p119f));
}

TEST(Radiance, PlanarRowsHoldRunsAndValues) {
  // Red 10 values of their own, green one run, blue a run and two values, one exponent.
  const auto image = read_rows("-Y 1 +X 10\n", {2,   2,  0, 10,                        //
                                                10,  1,  2, 3,  4, 5, 6, 7, 8, 9, 10,  //
                                                138, 7,                                //
                                                136, 9,  2, 3,  4,                     //
                                                138, 136});
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_THAT(reds(*image), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9, 10));
  EXPECT_EQ(image->rgb[1], 7);
  EXPECT_EQ(image->rgb[7 * 3 + 2], 9);
  EXPECT_EQ(image->rgb[9 * 3 + 2], 4);
}

TEST(Radiance, OldRunsRepeatThePixelBefore) {
  // 2 + 1 * 256 repeats.
  const auto image =
      read_rows("-Y 1 +X 260\n", {5, 0, 0, 136, 1, 1, 1, 2, 1, 1, 1, 1, 6, 0, 0, 136});
  ASSERT_TRUE(image.ok()) << image.error().message;
  std::vector<float> values = reds(*image);
  ASSERT_EQ(values.size(), 260u);
  EXPECT_EQ(values.back(), 6);
  values.pop_back();
  EXPECT_THAT(values, Each(5.0f));
}

TEST(Radiance, RowsThatDoNotFillTheirWidthAreErrors) {
  const std::string wide = "-Y 2 +X 8\n";
  for (const auto& pixels : {
           std::initializer_list<int>{2, 2, 0, 8, 137, 1},  // a run past the end
           {2, 2, 0, 8, 0},                                 // a run of nothing
           {2, 2, 0, 8, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9},      // values past the end
           {2, 2, 0, 8, 136},                               // a run without its value
           {1, 1, 1, 3},                                    // nothing to repeat
           {9, 9, 9, 9, 1, 1, 1, 8},                        // repeats past the end
       }) {
    const auto image = read_rows(wide, pixels);
    ASSERT_FALSE(image.ok());
    EXPECT_THAT(image.error().message, HasSubstr("a.hdr: not a readable Radiance HDR file: row 0"));
  }
}

TEST(Radiance, EveryOrientationIsTurned) {
  // A picture of two rows of three: 1 2 3, 4 5 6.
  const struct {
    const char* sides;
    std::array<int, 6> stored;
  } cases[] = {{"-Y 2 +X 3", {1, 2, 3, 4, 5, 6}}, {"+Y 2 +X 3", {4, 5, 6, 1, 2, 3}},
               {"-Y 2 -X 3", {3, 2, 1, 6, 5, 4}}, {"+Y 2 -X 3", {6, 5, 4, 3, 2, 1}},
               {"+X 3 -Y 2", {1, 4, 2, 5, 3, 6}}, {"-X 3 -Y 2", {3, 6, 2, 5, 1, 4}},
               {"+X 3 +Y 2", {4, 1, 5, 2, 6, 3}}, {"-X 3 +Y 2", {6, 3, 5, 2, 4, 1}}};
  for (const auto& c : cases) {
    ByteWriter writer;
    writer.put_raw(as_bytes_view(std::string(kStart) + c.sides + "\n"));
    for (const int red : c.stored)
      for (const int byte : {red, 0, 0, 136}) writer.put(static_cast<std::uint8_t>(byte));
    const auto image = read(writer.take());
    ASSERT_TRUE(image.ok()) << image.error().message;
    EXPECT_EQ(image->width, 3);
    EXPECT_THAT(reds(*image), ElementsAre(1, 2, 3, 4, 5, 6)) << c.sides;
  }
}

TEST(Radiance, HeadersAreReadAsProgramsWriteThem) {
  const auto read_with = [](const std::string& header) {
    return read(file_of(header, {5, 0, 0, 136}));
  };
  for (const char* header : {"#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 1 +X 1\r\n",
                             "#?RGBE\nFORMAT=32-bit_rle_rgbe \n\n-Y 1 +X 1\n",
                             "#?RADIANCE\nFORMAT= 32-bit_rle_rgbe\n\n-Y  1  +X  1 \n"}) {
    const auto image = read_with(header);
    ASSERT_TRUE(image.ok()) << image.error().message;
    EXPECT_THAT(image->rgb, ElementsAre(5, 0, 0));
  }
  const Bytes none = file_of("#?RADIANCE\n\n-Y 1 +X 1\n", {5, 0, 0, 136});
  EXPECT_THAT(read_radiance_header(none, "a.hdr")->notes, ElementsAre(HasSubstr("no line FORMAT")));
}

TEST(Radiance, XyzIsConverted) {
  // White of D65 with Y = 128 / 256 is (.4752, .5, .5445).
  const Bytes file =
      file_of("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n", {122, 128, 139, 128});
  const auto header = read_radiance_header(file, "a.hdr");
  ASSERT_TRUE(header.ok());
  auto image = read_radiance_pixels(file, *header, "a.hdr");
  ASSERT_TRUE(convert_to_rec709(image->rgb, 3, header->colors));
  for (const float v : image->rgb) EXPECT_NEAR(v, 0.5f, 0.006f);
  EXPECT_EQ(conversion_text(header->colors), "to Rec. 709, from CIE XYZ");
}

TEST(Radiance, HeadersSayWhatIsWrong) {
  const auto fault = [](const std::string& text) {
    return read_radiance_header(as_bytes_view(text), "a.hdr").error().message;
  };
  EXPECT_THAT(fault("P6\n"), HasSubstr("does not begin with #?"));
  EXPECT_THAT(fault("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n"), HasSubstr("header does not end"));
  EXPECT_THAT(fault("#?RADIANCE\nFORMAT=32-bit_rle_hsv\n\n-Y 1 +X 1\n"), HasSubstr("FORMAT="));
  for (const char* sides : {"+Y 1 +Y 1\n", "-Y 1 +X\n", "-Y 1 +X 99999999999\n", "Y 1 +X 1\n"}) {
    EXPECT_THAT(fault(std::string(kStart) + sides), HasSubstr("expected -Y HEIGHT +X WIDTH"));
  }
}

TEST(Radiance, KeysMayHaveSmallLetters) {
  const auto said = [](const std::string& line) {
    const Bytes file = file_of("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n" + line + "\n\n-Y 1 +X 1\n",
                               {128, 64, 32, 129});
    const auto header = read_radiance_header(file, "a.hdr");
    EXPECT_TRUE(header) << line;
    return header ? header->colors : ImageColors{};
  };
  for (const auto& [large, small] :
       {std::pair{"EXPOSURE=2", "exposure=2"},
        {"COLORCORR=1 2 4", "ColorCorr=1 2 4"},
        {"PRIMARIES=.7 .3 .2 .7 .1 .1 .3 .3", "primaries=.7 .3 .2 .7 .1 .1 .3 .3"},
        {"FORMAT=32-bit_rle_xyze", "format=32-bit_rle_xyze"}}) {
    EXPECT_EQ(said(small), said(large)) << small;
    EXPECT_NE(said(small), said("exposures=2")) << small;
  }
}

}  // namespace
}  // namespace baton
