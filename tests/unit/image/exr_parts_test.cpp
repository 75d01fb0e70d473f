// Files of several parts, layers and forms, through the one reader of pictures.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfRgbaFile.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/image/image_io.h"

namespace baton {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Part {
  std::string name;
  /// Channels of one pixel, with values first, first + 1 ...
  std::vector<std::string> channels;
  float first;
};

std::string exr_path(const std::string& name) { return testing::TempDir() + name; }

void write_parts(const std::string& path, const std::vector<Part>& parts) {
  std::vector<Imf::Header> headers;
  for (const Part& part : parts) {
    Imf::Header& header = headers.emplace_back(1, 1);
    header.setName(part.name);
    header.setType(Imf::SCANLINEIMAGE);
    for (const std::string& channel : part.channels)
      header.channels().insert(channel, Imf::Channel(Imf::FLOAT));
  }
  Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()));
  for (std::size_t p = 0; p < parts.size(); ++p) {
    std::vector<float> values;
    for (std::size_t c = 0; c < parts[p].channels.size(); ++c)
      values.push_back(parts[p].first + static_cast<float>(c));
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < values.size(); ++c)
      buffer.insert(parts[p].channels[c],
                    Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&values[c]), 4, 4));
    Imf::OutputPart output(file, static_cast<int>(p));
    output.setFrameBuffer(buffer);
    output.writePixels(1);
  }
}

TEST(ExrParts, TheFirstPartWithColoursIsThePicture) {
  const std::string path = exr_path("parts.exr");
  write_parts(path, {{"depth", {"Z"}, 5}, {"rgb", {"R", "G", "B"}, 1}});
  const auto depth_first = read_rgb_image(path);
  ASSERT_TRUE(depth_first) << depth_first.error().message;
  EXPECT_THAT(depth_first->rgb, ElementsAre(1, 2, 3));
  EXPECT_THAT(depth_first->notes, IsEmpty());
  write_parts(path, {{"left", {"R", "G", "B"}, 1}, {"right", {"R", "G", "B"}, 7}});
  const auto stereo = read_rgb_image(path);
  EXPECT_THAT(stereo->rgb, ElementsAre(1, 2, 3));
  EXPECT_THAT(stereo->notes, ElementsAre(HasSubstr("\"left\"")));
  write_parts(path, {{"depth", {"Z"}, 5}, {"id", {"u", "v"}, 1}});
  EXPECT_THAT(read_rgb_image(path).error().message, HasSubstr("no colours among Z, u, v"));
}

TEST(ExrParts, LuminanceAndChromaAreColours) {
  constexpr int kSide = 16;
  const std::vector<Imf::Rgba> pixels(kSide * kSide, Imf::Rgba(0.25f, 0.5f, 1, 0.5f));
  for (const auto channels : {Imf::WRITE_YC, Imf::WRITE_YCA}) {
    const std::string path = exr_path("yc.exr");
    {
      Imf::RgbaOutputFile file(path.c_str(), kSide, kSide, channels);
      file.setFrameBuffer(pixels.data(), 1, kSide);
      file.writePixels(kSide);
    }
    const auto image = read_rgb_image(path);
    ASSERT_TRUE(image) << image.error().message;
    EXPECT_NEAR(image->rgb[3 * 100], 0.25f, 0.005f);
    EXPECT_NEAR(image->rgb[3 * 100 + 2], 1, 0.01f);
  }
}

}  // namespace
}  // namespace baton
