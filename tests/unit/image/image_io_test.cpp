#include "common/image/image_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>

#include "common/base/files.h"
#include "common/image/exr_threads.h"
#include "tests/support/lent_threads.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

/// An empty folder for one test.
class ImageIoTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / "baton_image" / info->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  fs::path write(const std::string& name, ByteView bytes) const {
    fs::path path = folder_ / name;
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    return path;
  }

  fs::path folder_;
};

/// `channels` of 37 x 21 pixels, every value different and not a half.
FilmTile picture(std::vector<std::string> channels) {
  FilmTile image{{0, 0, 37, 21}, std::move(channels), {}};
  image.values.resize(image.channels.size() * image.num_pixels());
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = 0.1f + static_cast<float>(i) / 1000;
  return image;
}

Bytes file_bytes(const fs::path& path) { return *read_file(path, 1 << 26); }

/// A 2 x 1 Radiance picture without run lengths: (1, 0.5, 0.25) and black.
Bytes radiance_picture() {
  ByteWriter writer;
  writer.put_raw(as_bytes_view("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n"));
  for (const int value : {128, 64, 32, 129, 0, 0, 0, 0})
    writer.put(static_cast<std::uint8_t>(value));
  return writer.take();
}

TEST_F(ImageIoTest, FloatExrGivesBackTheSameBits) {
  for (const char* compression : {"none", "rle", "zips", "zip", "piz"}) {
    const FilmTile image = picture({"A", "B", "G", "R", "source.R"});
    const fs::path path = folder_ / (std::string(compression) + ".exr");
    const Status written =
        write_exr(path, image, {.half_float = false, .compression = compression, .metadata = {}});
    ASSERT_TRUE(written.ok()) << written.error().message;
    const Result<FilmTile> read = read_exr(path);
    ASSERT_TRUE(read.ok()) << read.error().message;
    EXPECT_TRUE(*read == image) << compression;
  }
}

TEST_F(ImageIoTest, HalfExrKeepsWholeChannelsExact) {
  const FilmTile image = picture({"R", "depth", "lns", "normal.X", "variance"});
  const fs::path path = folder_ / "half.exr";
  ASSERT_TRUE(write_exr(path, image, {.whole = {"depth", "lns", "normal.X", "variance"}}).ok());
  const Result<FilmTile> read = read_exr(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->channels, image.channels);
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    for (std::size_t i = 0; i < image.num_pixels(); ++i) {
      // Half has 11 bits of mantissa.
      const float tolerance = c == 0 ? image.plane(c)[i] * 0x1p-11f : 0.0f;
      ASSERT_NEAR(read->plane(c)[i], image.plane(c)[i], tolerance) << image.channels[c] << ' ' << i;
    }
  }
}

TEST_F(ImageIoTest, HalfChannelsStopAtTheLargestHalf) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const FilmTile image{
      {0, 0, 4, 1}, {"R", "lns"}, {1e6f, -1e6f, kInfinity, 65504.0f, 1e6f, 0, 0, 0}};
  const fs::path path = folder_ / "sun.exr";
  ASSERT_TRUE(write_exr(path, image, {.whole = {"lns"}}).ok());
  EXPECT_THAT(read_exr(path)->values, ElementsAre(65504, -65504, 65504, 65504, 1e6f, 0, 0, 0));
}

TEST_F(ImageIoTest, ChannelsComeBackInFileOrderWithTheirPlanes) {
  FilmTile image = picture({"R", "G", "B", "depth"});
  const fs::path path = folder_ / "order.exr";
  ASSERT_TRUE(
      write_exr(path, image, {.half_float = false, .compression = "zip", .metadata = {}}).ok());
  const Result<FilmTile> read = read_exr(path);
  ASSERT_TRUE(read.ok());
  EXPECT_THAT(read->channels, ElementsAre("B", "G", "R", "depth"));
  EXPECT_TRUE(std::equal(image.plane(0), image.plane(1), read->plane(2)));
  EXPECT_TRUE(std::equal(image.plane(2), image.plane(3), read->plane(0)));
}

TEST_F(ImageIoTest, ExrBytesAreDeterministicAndMetadataIsKept) {
  const ImageMetadata metadata = {{"batonJob", "0123abcd"}, {"batonVersion", "0.1.0"}};
  for (const char* name : {"a.exr", "b.exr"}) {
    ASSERT_TRUE(write_exr(folder_ / name, picture({"R", "G", "B"}), {.metadata = metadata}).ok());
  }
  EXPECT_EQ(file_bytes(folder_ / "a.exr"), file_bytes(folder_ / "b.exr"));
  const Result<ImageMetadata> read = read_exr_metadata(folder_ / "a.exr");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(*read, metadata);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator{}), 2)
      << "no temporary file stays";
}

TEST_F(ImageIoTest, WritingSaysWhatIsWrong) {
  const FilmTile image = picture({"R"});
  EXPECT_THAT(
      write_exr(folder_ / "a.exr", image, {.compression = "jpg", .metadata = {}}).error().message,
      HasSubstr("compression jpg, expected none, rle, zips, zip or piz"));
  EXPECT_THAT(
      write_exr(folder_ / "a.exr", image, {.metadata = {{"channels", "x"}}}).error().message,
      HasSubstr("metadata channels is there already"));
  ASSERT_TRUE(write_file_atomic(folder_ / "file", {}).ok());
  const Status status = write_exr(folder_ / "file" / "a.exr", image, {});
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::io);
}

/// The time code of frame `number`; empty: the header has none.
std::string time_code(const std::filesystem::path& path, int number, double rate) {
  FilmTile pixel{{0, 0, 1, 1}, {"R"}, {1}};
  EXPECT_TRUE(write_exr(path, pixel, {.frames_per_second = rate, .frame_number = number}).ok());
  const ImageMetadata metadata = read_exr_metadata(path).value();
  for (const auto& [name, value] : metadata) {
    if (name == "timeCode") return value;
  }
  return "";
}

TEST_F(ImageIoTest, TimeCodesCountFramesOfWholeRates) {
  const auto path = folder_ / "t.exr";
  EXPECT_EQ(time_code(path, 0, 24), "00:00:00:00");
  EXPECT_EQ(time_code(path, 47, 24), "00:00:01:23");
  EXPECT_EQ(time_code(path, 29, 30), "00:00:00:29");
  EXPECT_EQ(time_code(path, 25 * 3600 * 25 + 61 * 25 + 3, 25), "01:01:01:03") << "modulo a day";
  EXPECT_EQ(time_code(path, 12, 24000.0 / 1001), "");
  EXPECT_EQ(time_code(path, 12, 48), "") << "past what the field holds";
}

TEST_F(ImageIoTest, ReadsRgbFromExrWithoutAlpha) {
  const FilmTile image = picture({"A", "B", "G", "R"});
  ASSERT_TRUE(write_exr(folder_ / "a.exr", image,
                        {.half_float = false, .compression = "zip", .metadata = {}})
                  .ok());
  const Result<RgbImage> read = read_rgb_image(folder_ / "a.exr");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->width, 37);
  EXPECT_EQ(read->height, 21);
  ASSERT_EQ(read->rgb.size(), 37u * 21 * 3);
  EXPECT_EQ(read->rgb[3 * 40 + 0], image.plane(3)[40]);
  EXPECT_EQ(read->rgb[3 * 40 + 1], image.plane(2)[40]);
  EXPECT_EQ(read->rgb[3 * 40 + 2], image.plane(1)[40]);
}

TEST_F(ImageIoTest, GreyIsSpreadToThreeChannels) {
  const FilmTile image = picture({"Y"});
  ASSERT_TRUE(write_exr(folder_ / "y.exr", image,
                        {.half_float = false, .compression = "zip", .metadata = {}})
                  .ok());
  const Result<RgbImage> read = read_rgb_image(folder_ / "y.exr");
  ASSERT_TRUE(read.ok()) << read.error().message;
  for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(read->rgb[3 * 5 + c], image.values[5]);
}

TEST_F(ImageIoTest, ExrWithoutRgbNamesItsChannels) {
  ASSERT_TRUE(write_exr(folder_ / "n.exr", picture({"normal.X", "normal.Y"}), {}).ok());
  EXPECT_THAT(read_rgb_image(folder_ / "n.exr").error().message,
              HasSubstr("no colours among normal.X, normal.Y, expected R, G, B or one channel"));
}

TEST_F(ImageIoTest, ReadsRadiancePictures) {
  const Result<RgbImage> read = read_rgb_image(write("map.hdr", radiance_picture()));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->width, 2);
  EXPECT_EQ(read->height, 1);
  EXPECT_THAT(read->rgb, ElementsAre(1, 0.5f, 0.25f, 0, 0, 0));
}

TEST_F(ImageIoTest, TheContentDecidesNotTheName) {
  EXPECT_TRUE(read_rgb_image(write("really_hdr.exr", radiance_picture())).ok());
}

TEST_F(ImageIoTest, WhatIsNoPictureIsAnErrorWithItsName) {
  const fs::path text = write("text.exr", as_bytes_view("this is no picture"));
  EXPECT_EQ(read_rgb_image(text).error().message,
            text.string() + ": neither an EXR nor a Radiance HDR picture");
  EXPECT_THAT(read_exr(text).error().message,
              HasSubstr(text.string() + ": not a readable EXR file"));
  EXPECT_THAT(read_exr_metadata(text).error().message, HasSubstr(text.string()));
  EXPECT_FALSE(read_rgb_image(write("empty.exr", {})).ok());
  EXPECT_FALSE(read_rgb_image(write("text.hdr", as_bytes_view("#?but no header follows"))).ok());
  EXPECT_EQ(read_rgb_image(folder_ / "missing.exr").error().kind, ErrorKind::io);
  EXPECT_THAT(read_rgb_image(folder_).error().message, HasSubstr("is a folder, expected a file"));
  EXPECT_EQ(read_exr(folder_ / "missing.exr").error().kind, ErrorKind::io);
}

TEST_F(ImageIoTest, ATruncatedExrIsAnErrorAndNeverZeros) {
  ASSERT_TRUE(write_exr(folder_ / "whole.exr", picture({"B", "G", "R"}), {}).ok());
  const Bytes whole = file_bytes(folder_ / "whole.exr");
  for (std::size_t size = 4; size < whole.size(); size += 1 + size / 40) {
    const fs::path cut = write("cut.exr", ByteView(whole).first(size));
    EXPECT_FALSE(read_rgb_image(cut).ok()) << size << " of " << whole.size() << " bytes";
    EXPECT_FALSE(read_exr(cut).ok()) << size << " of " << whole.size() << " bytes";
  }
  EXPECT_FALSE(read_exr(write("cut.exr", ByteView(whole).first(whole.size() - 1))).ok());
}

TEST_F(ImageIoTest, ATruncatedRadiancePictureIsAnError) {
  const Bytes whole = radiance_picture();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(read_rgb_image(write("cut.hdr", ByteView(whole).first(size))).ok())
        << size << " bytes";
  }
}

TEST_F(ImageIoTest, ADamagedExrNeverCrashes) {
  ASSERT_TRUE(write_exr(folder_ / "whole.exr", picture({"B", "G", "R"}), {}).ok());
  const Bytes whole = file_bytes(folder_ / "whole.exr");
  for (std::size_t i = 0; i < std::min<std::size_t>(whole.size(), 500); ++i) {
    Bytes bad = whole;
    bad[i] ^= std::byte{0xFF};
    const Result<FilmTile> read = read_exr(write("bad.exr", bad));
    if (read) continue;
    EXPECT_THAT(read.error().message, HasSubstr("bad.exr: "));
  }
}

TEST_F(ImageIoTest, HugeSidesAreRefusedBeforeReading) {
  ByteWriter writer;
  writer.put_raw(as_bytes_view("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 40000 +X 40000\n"));
  EXPECT_THAT(read_rgb_image(write("huge.hdr", writer.bytes())).error().message,
              HasSubstr("40000 x 40000 pixels, expected 1 to 32768 a side"));
}

// By the header: of the first file there is nothing else.
TEST_F(ImageIoTest, MorePixelsThanThereIsMemoryForAreRefusedBeforeReading) {
  ByteWriter writer;
  writer.put_raw(as_bytes_view("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 16384\n"));
  const PixelLimit limit{20'000'000, ", of 800 MiB"};
  EXPECT_THAT(
      read_rgb_image(write("huge.hdr", writer.bytes()), ExrWindow::display, limit).error().message,
      HasSubstr("16384 x 8192 pixels, expected at most 20.0 million, of 800 MiB"));
  const fs::path exr = folder_ / "a.exr";
  for (const bool is_framed : {false, true}) {
    const std::optional<PixelRect> shown =
        is_framed ? std::optional(PixelRect{0, 0, 200, 10}) : std::nullopt;
    ASSERT_TRUE(write_exr(exr, picture({"R", "G", "B"}), {.display_window = shown}));
    const PixelLimit most{is_framed ? 1999 : 776};
    const Result<RgbImage> image = read_rgb_image(exr, ExrWindow::display, most);
    ASSERT_FALSE(image.ok());
    EXPECT_EQ(image.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(image.error().message, HasSubstr(is_framed ? "200 x 10 pixels" : "37 x 21 pixels"));
    EXPECT_TRUE(read_rgb_image(exr, ExrWindow::display, {most.most + 1}));
  }
}

TEST_F(ImageIoTest, PngIsWrittenWholeAndDeterministic) {
  const RgbImage image{
      2, 2, {0, 0.5f, 1, 2, -1, std::nanf(""), 0.1f, 0.2f, 0.3f, 0.001f, 0.9f, 0.0f}};
  for (const char* name : {"a.png", "b.png"}) {
    const Status written = write_png(folder_ / name, image);
    ASSERT_TRUE(written.ok()) << written.error().message;
  }
  const Bytes bytes = file_bytes(folder_ / "a.png");
  EXPECT_EQ(bytes, file_bytes(folder_ / "b.png"));
  // Signature, then IHDR: 2 x 2 pixels, 8 bits, RGB.
  const unsigned char expected[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 0, 0, 0, 13, 'I',
                                    'H',  'D', 'R', 0,   0,    0,    2,    0,    0, 0, 2, 8,  2};
  ASSERT_GT(bytes.size(), sizeof(expected));
  EXPECT_TRUE(std::ranges::equal(ByteView(bytes).first(sizeof(expected)),
                                 std::as_bytes(std::span(expected))));
}

/// A picture whose header says something else behind `key`.
Bytes with_claim(Bytes bytes, std::string_view key, std::uint32_t claim) {
  const auto found = std::ranges::search(bytes, as_bytes_view(key));
  EXPECT_FALSE(found.empty());
  if (!found.empty()) std::memcpy(&*found.end(), &claim, sizeof(claim));
  return bytes;
}

TEST_F(ImageIoTest, TheBytesOfAnImageAreTheSameWhoeverCompressesIt) {
  FilmTile image{{-3, 5, 120, 400}, {"R", "G", "B"}, {}};
  image.values.resize(3 * image.num_pixels());
  for (std::size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = std::sin(static_cast<float>(i % 977));
  for (const char* const compression : {"none", "rle", "zips", "zip", "piz"}) {
    SCOPED_TRACE(compression);
    const Bytes alone = *encode_exr("a.exr", image, {.compression = compression});
    LentThreads others;
    {
      const ExrThreads threads(others.lend());
      EXPECT_EQ(*encode_exr("a.exr", image, {.compression = compression}), alone);
    }
    EXPECT_GT(others.join(), 10u);
    EXPECT_EQ(*encode_exr("a.exr", image, {.compression = compression}), alone);
  }
}

// OpenEXR would reserve gigabytes for a row.
TEST_F(ImageIoTest, AnImageThatIsTooLargeIsAnErrorBeforeItsMemoryIsReserved) {
  using namespace std::string_view_literals;
  const Bytes bytes = *encode_exr("a.exr", picture({"R", "G", "B"}), {});
  const auto key = "dataWindow\0box2i\0\x10\0\0\0"sv;
  for (const std::uint32_t corner : {0xff000000u, 0x7fffffffu}) {
    const Result<FilmTile> read = read_exr(write("a.exr", with_claim(bytes, key, corner)));
    ASSERT_FALSE(read.ok());
    EXPECT_THAT(read.error().message, HasSubstr("a.exr: dataWindow: expected sides of 1 to 32768"));
  }
}

// OpenEXR would first reserve what it says.
TEST_F(ImageIoTest, AnAttributeThatSaysItIsLargerThanTheFileIsAnError) {
  const Bytes bytes =
      *encode_exr("a.exr", picture({"R", "G", "B"}), {.metadata = {{"note", "abc"}}});
  const std::string_view key("note\0string\0", 12);
  const Result<FilmTile> read = read_exr(write("a.exr", with_claim(bytes, key, 0x7ffffff0)));
  ASSERT_FALSE(read.ok());
  EXPECT_THAT(read.error().message,
              HasSubstr("a.exr: not a readable EXR file: attribute note is not as long"));
}

}  // namespace
}  // namespace baton
