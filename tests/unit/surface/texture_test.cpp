#include "worker/surface/texture_lookup.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>

#include "common/scene/texture/texture.h"
#include "tests/support/image_files.h"
#include "tests/support/instruction_sets.h"

namespace baton {
namespace {

using test::write_targa;
using test::write_test_file;
using testing::HasSubstr;

/// An image of integers; the second or the fourth channel is alpha.
Image image_of(int width, int height, int channels, std::vector<float> samples) {
  return {width, height, channels, std::move(samples), true, channels % 2 == 0};
}

std::shared_ptr<const Texture> texture_of(const Image& image, TextureUse use) {
  auto texture = Texture::build(image, use, "test");
  EXPECT_TRUE(texture.ok()) << (texture.ok() ? "" : texture.error().message);
  return *texture;
}

/// Four grey steps side by side: 0, 1/3, 2/3, 1.
std::shared_ptr<const Texture> ramp() {
  return texture_of(image_of(4, 1, 1, {0, 1 / 3.0f, 2 / 3.0f, 1}), TextureUse::metallic_roughness);
}

std::string error_of(const Result<Image>& image) {
  return image.ok() ? "none" : image.error().message;
}

TEST(Texture, EverySmallerImageHasTheSameMean) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const auto& [width, height] : {std::pair{64, 32}, {13, 7}, {1, 9}, {17, 1}, {1, 1}}) {
    std::vector<float> samples;
    double mean = 0;
    for (int i = 0; i < width * height * 3; ++i) {
      samples.push_back(uniform(random));
      mean += i % 3 == 1 ? samples.back() : 0;
    }
    mean /= width * height;
    const auto texture = texture_of(image_of(width, height, 3, samples), TextureUse::normal);
    int w = width, h = height;
    for (std::int32_t level = 0; level < texture->num_levels(); ++level) {
      double sum = 0;
      for (int y = 0; y < h; ++y) {
        for (int x = 0; x < w; ++x) sum += texture->texel(level, x, y)[1];
      }
      EXPECT_NEAR(sum / (w * h), mean, 1e-5) << width << " x " << height << ", level " << level;
      w = std::max(w / 2, 1);
      h = std::max(h / 2, 1);
    }
  }
}

TEST(Texture, ColoursBecomeLinearBeforeTheyAreAveraged) {
  const Image image = image_of(2, 1, 3, {0, 0.5f, 1, 1, 0.5f, 1});
  const auto color = texture_of(image, TextureUse::color);
  EXPECT_NEAR(color->texel(0, 0, 0)[1], 0.21404f, 1e-4f);
  EXPECT_NEAR(color->texel(1, 0, 0)[0], 0.5f, 1e-4f);
  EXPECT_NEAR(color->texel(1, 0, 0)[2], 1.0f, 1e-6f);
  EXPECT_NEAR(texture_of(image, TextureUse::normal)->texel(0, 0, 0)[1], 0.5f, 1e-4f);
  Image floats = image;
  floats.is_integer = false;
  floats.samples[0] = 8;
  floats.samples[1] = NAN;
  const auto linear = texture_of(floats, TextureUse::color);
  EXPECT_NEAR(linear->texel(0, 0, 0)[0], 8, 1e-3f);
  EXPECT_EQ(linear->texel(0, 0, 0)[1], 0);
  EXPECT_NEAR(linear->texel(0, 1, 0)[1], 0.5f, 1e-3f);
}

TEST(Texture, WhatItCannotHoldIsCountedByTexels) {
  Image image = image_of(3, 2, 4, std::vector<float>(24, 0.5f));
  EXPECT_THAT(repair_notes(texture_of(image, TextureUse::color)->repairs()), testing::IsEmpty());
  image.is_integer = false;
  image.samples[0] = NAN;
  image.samples[1] = -1;  // of the same texel
  image.samples[5] = INFINITY;
  image.samples[8] = 1e6f;
  image.samples[15] = -INFINITY;  // alpha
  const auto color = texture_of(image, TextureUse::color);
  EXPECT_EQ(color->texel(0, 1, 0)[1], 0) << "as in maps";
  EXPECT_NEAR(color->texel(0, 2, 0)[0], 65504, 1);
  EXPECT_THAT(repair_notes(color->repairs()),
              testing::ElementsAre("2 texels are negative, NaN or infinite and count as 0",
                                   "1 texels are brighter than 65504 and cut"));
  EXPECT_EQ(texture_of(image, TextureUse::color_and_alpha)->repairs().unusable, 3u);
  EXPECT_EQ(texture_of(image, TextureUse::green)->repairs().unusable, 2u);
}

TEST(Texture, ChannelsGoWhereTheirUseSays) {
  const Image rgba = image_of(1, 1, 4, {0.1f, 0.2f, 0.3f, 0.4f});
  const auto pair = texture_of(rgba, TextureUse::metallic_roughness)->texel(0, 0, 0);
  EXPECT_NEAR(pair[0], 0.2f, 1e-5f);
  EXPECT_NEAR(pair[1], 0.3f, 1e-5f);
  EXPECT_TRUE(texture_of(rgba, TextureUse::color_and_alpha)->has_alpha());
  EXPECT_NEAR(texture_of(rgba, TextureUse::color_and_alpha)->texel(0, 0, 0)[3], 0.4f, 1e-5f);
  EXPECT_FALSE(texture_of(rgba, TextureUse::color)->has_alpha());
  const Image grey = image_of(1, 1, 2, {1, 0.25f});
  EXPECT_NEAR(texture_of(grey, TextureUse::color_and_alpha)->texel(0, 0, 0)[2], 1, 1e-5f);
  EXPECT_NEAR(texture_of(grey, TextureUse::color_and_alpha)->texel(0, 0, 0)[3], 0.25f, 1e-5f);
  const auto flat = Texture::build(grey, TextureUse::normal, "grey.png");
  ASSERT_FALSE(flat.ok());
  EXPECT_EQ(flat.error().message,
            "grey.png: expected red, green and blue of a normal map, got 2 channels");
}

TEST(Texture, AChannelIsAlphaWhereTheImageSaysSoAlone) {
  Image two = image_of(1, 1, 2, {0.5f, 0.25f});
  two.is_integer = two.has_alpha = false;  // red and green
  const auto color = texture_of(two, TextureUse::color_and_alpha);
  EXPECT_FALSE(color->has_alpha());
  EXPECT_THAT(color->texel(0, 0, 0),
              testing::Pointwise(testing::FloatNear(1e-5f), std::array{0.5f, 0.25f, 0.0f, 0.0f}));
  EXPECT_NEAR(texture_of(two, TextureUse::green)->texel(0, 0, 0)[0], 0.25f, 1e-5f);
  EXPECT_NEAR(texture_of(two, TextureUse::metallic_roughness)->texel(0, 0, 0)[0], 0.25f, 1e-5f);
  EXPECT_FALSE(Texture::build(two, TextureUse::normal, "rg.exr").ok());
}

TEST(Texture, GoesOnPastItsEdges) {
  const auto texture = ramp();
  const auto at = [&](float u, Wrap wrap, bool nearest) {
    return look_up(*texture, {u, 0.5f}, {}, {wrap, Wrap::repeat, nearest})[0];
  };
  EXPECT_NEAR(at(1.125f, Wrap::repeat, true), 0, 1e-5f);
  EXPECT_NEAR(at(1.125f, Wrap::clamp, true), 1, 1e-5f);
  EXPECT_NEAR(at(1.125f, Wrap::mirror, true), 1, 1e-5f);
  EXPECT_NEAR(at(-0.375f, Wrap::repeat, true), 2 / 3.0f, 1e-5f);
  EXPECT_NEAR(at(-0.375f, Wrap::clamp, true), 0, 1e-5f);
  EXPECT_NEAR(at(-0.375f, Wrap::mirror, true), 1 / 3.0f, 1e-5f);
  EXPECT_NEAR(at(1, Wrap::repeat, false), 0.5f, 1e-5f);  // between the last and the first
  EXPECT_NEAR(at(1, Wrap::clamp, false), 1, 1e-5f);
  EXPECT_NEAR(at(0.375f, Wrap::repeat, false), 1 / 3.0f, 1e-5f);
  for (const float far : {1e30f, -1e30f, INFINITY, NAN}) {
    for (const Wrap wrap : {Wrap::repeat, Wrap::clamp, Wrap::mirror})
      EXPECT_GE(at(far, wrap, false), 0) << far;
  }
}

TEST(Texture, BeyondAClampedEdgeLiesTheEdgeOfTheImage) {
  // Dark, with a bright last column and a bright first row.
  for (const int size : {64, 37}) {
    std::vector<float> texels(static_cast<std::size_t>(size * size));
    for (int i = 0; i < size; ++i)
      texels[static_cast<std::size_t>(i * size + size - 1)] = texels[static_cast<std::size_t>(i)] =
          1;
    const auto texture =
        texture_of(image_of(size, size, 1, texels), TextureUse::metallic_roughness);
    const auto at = [&](float u, float v, float width, Wrap wrap) {
      return look_up(*texture, {u, v}, {{width, 0}, {0, width}}, {wrap, wrap, false})[0];
    };
    for (const float width : {0.03f, 0.1f, 0.25f, 0.9f}) {
      EXPECT_NEAR(at(1 + width, 0.6f, width, Wrap::clamp), 1, 2e-4f) << width;
      EXPECT_NEAR(at(0.4f, -width, width, Wrap::clamp), 1, 2e-4f) << width;
      EXPECT_NEAR(at(-width, -width, width, Wrap::clamp), 1, 2e-4f) << width;
      EXPECT_NEAR(at(-width, 1 + width, width, Wrap::clamp), 0, 2e-4f) << width;
    }
    // A footprint within the image has no more of the edge than the image.
    EXPECT_LT(at(1, 0.6f, 0.25f, Wrap::clamp), 0.15f);
    EXPECT_LT(at(1.5f, 0.6f, 0.25f, Wrap::repeat), 0.1f);
  }
}

// A surface that ends with the image has its mean, and one that goes on that of image and edge,
// however the footprints of its sites reach over the edge.
TEST(Texture, SitesOfAClampedImageHaveItsMean) {
  for (const int size : {64, 37, 5, 2}) {
    // Dark in a bright frame one texel wide, whose columns on the left are brightest.
    std::vector<float> texels(static_cast<std::size_t>(size * size));
    double sum = 0;
    for (int i = 0; i < size * size; ++i) {
      const int x = i % size, y = i / size;
      const bool is_frame = x == size - 1 || y == 0 || y == size - 1;
      sum += texels[static_cast<std::size_t>(i)] = x == 0 ? 1.0f : is_frame ? 0.5f : 0.0f;
    }
    const double inside = sum / size / size;
    const auto texture =
        texture_of(image_of(size, size, 1, texels), TextureUse::metallic_roughness);
    const auto mean = [&](const Footprint& seen, Wrap wrap, float from, float to) {
      constexpr int kSites = 240;
      double total = 0;
      for (int i = 0; i < kSites * kSites; ++i) {
        const float u = (static_cast<float>(i % kSites) + 0.5f) / kSites;
        const float v = (static_cast<float>(i / kSites) + 0.5f) / kSites;
        total += look_up(*texture, {from + (to - from) * u, v}, seen, {wrap, wrap, false})[0];
      }
      return total / kSites / kSites;
    };
    for (const float width : {0.02f, 0.1f, 0.3f, 0.9f, 2.5f}) {
      for (const Footprint& seen : {Footprint{{width, 0}, {0, width}},
                                    {{0, width}, {width / 9, 0}},
                                    {{width, width / 2}, {0.01f, -0.02f}}}) {
        for (const Wrap wrap : {Wrap::clamp, Wrap::mirror})
          EXPECT_NEAR(mean(seen, wrap, 0, 1), inside, 0.012) << size << ' ' << width;
        // Two images wide on the left: half of it is the edge.
        EXPECT_NEAR(mean(seen, Wrap::clamp, -1, 1), (inside + 1) / 2, 0.012)
            << size << ' ' << width;
      }
    }
  }
}

TEST(Texture, AFootprintIsAveragedAlongBothSides) {
  // Bright and dark rows.
  std::vector<float> rows;
  for (int i = 0; i < 64 * 64; ++i) rows.push_back(i / 64 % 2 == 0 ? 1.0f : 0.0f);
  const auto texture = texture_of(image_of(64, 64, 1, rows), TextureUse::metallic_roughness);
  const auto at = [&](const Footprint& footprint) {
    return look_up(*texture, {0.5f, 10.5f / 64}, footprint, {})[0];
  };
  EXPECT_NEAR(at({}), 1, 1e-5f);
  EXPECT_NEAR(at({{1, 0}, {0, 1}}), 0.5f, 1e-4f);
  EXPECT_NEAR(at({{0, 0.25f}, {0.25f, 0}}), 0.5f, 1e-4f);
  // Long along the rows and thin across them: it stays within one.
  EXPECT_NEAR(at({{0.2f, 0}, {0, 1 / 64.0f}}), 1, 1e-5f);
  EXPECT_NEAR(at({{0, 1 / 64.0f}, {0.2f, 0}}), 1, 1e-5f);
  EXPECT_NEAR(at({{INFINITY, 0}, {0, 1}}), 0.5f, 1e-4f);
}

/// Random numbers for each channel of each texel.
std::shared_ptr<const Texture> noise(int width, int height, int channels, TextureUse use,
                                     unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<float> samples(static_cast<std::size_t>(width * height * channels));
  for (float& v : samples) v = uniform(random);
  return texture_of(image_of(width, height, channels, samples), use);
}

/// Texel i of an endless row of images.
int texel_of_row(int i, int size, Wrap wrap) {
  if (wrap == Wrap::clamp) return std::clamp(i, 0, size - 1);
  const int image = static_cast<int>(std::floor(static_cast<double>(i) / size));
  const int within = i - image * size;
  return wrap == Wrap::mirror && image % 2 != 0 ? size - 1 - within : within;
}

class TextureBlend : public OnInstructionSet {};
INSTANTIATE_TEST_SUITE_P(Sets, TextureBlend, testing::ValuesIn(instruction_sets()),
                         instruction_set_name);

TEST_P(TextureBlend, IsOfTheFourTexelsAround) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(-3, 3);
  for (const auto& [width, height] : {std::pair{5, 3}, {1, 4}, {8, 1}, {2, 2}, {1, 1}}) {
    const auto texture = noise(width, height, 3, TextureUse::normal, 2);
    for (int i = 0; i < 900; ++i) {
      const auto wrap_u = static_cast<Wrap>(i % 3), wrap_v = static_cast<Wrap>(i / 3 % 3);
      // Beyond a clamped edge lies what is at the edge.
      const float u = uniform(random), v = uniform(random);
      const float x = u * static_cast<float>(width) - 0.5f;
      const float y = v * static_cast<float>(height) - 0.5f;
      const int column = static_cast<int>(std::floor(x)), row = static_cast<int>(std::floor(y));
      std::array<float, 4> expected{};
      for (const int k : {0, 1, 2, 3}) {
        const int i_x = column + k % 2, i_y = row + k / 2;
        const float w = (1 - std::abs(x - static_cast<float>(i_x))) *
                        (1 - std::abs(y - static_cast<float>(i_y)));
        const auto texel =
            texture->texel(0, texel_of_row(i_x, width, wrap_u), texel_of_row(i_y, height, wrap_v));
        for (std::size_t c = 0; c < 4; ++c) expected[c] += w * texel[c];
      }
      const auto got = look_up(*texture, {u, v}, {}, {wrap_u, wrap_v, false});
      for (std::size_t c = 0; c < 4; ++c)
        EXPECT_NEAR(got[c], expected[c], 2e-5f) << u << ' ' << v << ' ' << i % 9 << ' ' << c;
    }
  }
}

TEST(Texture, ImagesLookedUpTogetherAreLookedUpAsAlone) {
  const std::array textures{
      noise(64, 32, 3, TextureUse::normal, 1), noise(64, 32, 3, TextureUse::metallic_roughness, 2),
      noise(64, 32, 4, TextureUse::color_and_alpha, 3), noise(17, 40, 1, TextureUse::red, 4),
      noise(64, 32, 3, TextureUse::color, 5)};
  std::array<const Texture*, 5> images{};
  std::transform(textures.begin(), textures.end(), images.begin(),
                 [](const auto& texture) { return texture.get(); });
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-2, 2);
  for (int i = 0; i < 500; ++i) {
    const std::array uv{uniform(random), uniform(random)};
    const float size = i % 5 == 0 ? 0 : std::exp2(2 * uniform(random) - 4);
    const Footprint seen{{size * uniform(random), size * uniform(random)},
                         {size * uniform(random), size * uniform(random)}};
    const TextureSampling sampling{static_cast<Wrap>(i % 3), static_cast<Wrap>(i / 3 % 3),
                                   i % 2 == 0};
    std::array<std::array<float, 4>, 5> means;
    look_up_together(images, uv, seen, sampling, means);
    for (std::size_t k = 0; k < images.size(); ++k)
      EXPECT_EQ(means[k], look_up(*images[k], uv, seen, sampling)) << k;
    EXPECT_EQ(means[1][2], 0);
    EXPECT_EQ(means[3][1], 0);
  }
}

TEST(ImageReader, ReadsFilesAndBytes) {
  const std::vector<std::uint8_t> values{255, 0, 51, 255, 0, 102, 0, 0};
  const auto image = read_image(write_targa("two.tga", 2, 1, 4, values));
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_EQ(image->width, 2);
  EXPECT_EQ(image->channels, 4);
  EXPECT_TRUE(image->is_integer && image->has_alpha && !image->is_associated);
  // Colours are not multiplied by alpha.
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_NEAR(image->samples[i], values[i] / 255.0f, 1e-6f) << i;
}

TEST(ImageReader, GreyMayHaveAlpha) {
  const Image image = read_image(write_targa("grey.tga", 2, 1, 2, {255, 51, 0, 255})).value();
  EXPECT_TRUE(image.has_alpha && !image.is_associated);
  EXPECT_EQ(image.num_colors(), 1);
  EXPECT_THAT(image.samples,
              testing::Pointwise(testing::FloatNear(1e-6f), std::array{1.0f, 0.2f, 0.0f, 1.0f}));
}

TEST(ImageReader, AlphaIsWhatATiffFileCallsSo) {
  const std::vector<float> values{0.1f, 0.2f, 0.3f, 0.5f};
  const auto read = [&](test::TiffExtra extra) {
    return read_image(test::write_tiff("extra.tif", 1, 1, extra, values)).value();
  };
  for (const auto extra : {test::TiffExtra::associated, test::TiffExtra::unassociated}) {
    const Image image = read(extra);
    EXPECT_TRUE(image.has_alpha);
    EXPECT_EQ(image.is_associated, extra == test::TiffExtra::associated);
    EXPECT_EQ(image.samples, values);
  }
  const Image plain = read(test::TiffExtra::unspecified);
  EXPECT_FALSE(plain.has_alpha);
  EXPECT_EQ(plain.samples, (std::vector<float>{0.1f, 0.2f, 0.3f}));
}

// (200, 100, 50) of alpha 128 beside green of alpha 255.
constexpr unsigned char kWebp[] = {0x52, 0x49, 0x46, 0x46, 0x20, 0,    0,    0,    0x57, 0x45,
                                   0x42, 0x50, 0x56, 0x50, 0x38, 0x4c, 0x14, 0,    0,    0,
                                   0x2f, 0x01, 0,    0,    0x10, 0x0f, 0xf0, 0xb2, 0xff, 0x41,
                                   0x1e, 0x99, 0x07, 0xfe, 0x47, 0x1a, 0x32, 0xa2, 0xff, 0x01};

TEST(ImageReader, ColoursOfWebpFilesAreNotMultipliedByAlpha) {
  const auto image = read_image(std::as_bytes(std::span(kWebp)), "set.glb, image 1");
  ASSERT_TRUE(image.ok()) << image.error().message;
  EXPECT_TRUE(image->has_alpha && image->is_integer && !image->is_associated);
  const float expected[] = {200, 100, 50, 128, 0, 255, 0, 255};
  for (std::size_t i = 0; i < 8; ++i)
    EXPECT_NEAR(image->samples[i], expected[i] / 255, 1 / 255.0f) << i;
}

TEST(ImageReader, WhatIsOddAboutJpegFilesIsSaid) {
  const auto read = [](const std::string& bytes) {
    const Image file = read_image(write_test_file("odd.jpg", bytes)).value();
    const Image same = read_image(std::as_bytes(std::span(bytes)), "set.glb, image 0").value();
    EXPECT_EQ(file.samples, same.samples);
    EXPECT_EQ(file.notes, same.notes);
    return file;
  };
  const Image red = read(test::jpeg({255, 128, 0}, true));
  EXPECT_THAT(std::vector(red.samples.begin(), red.samples.begin() + 3),
              testing::Pointwise(testing::FloatNear(0.01f), std::array{1.0f, 0.5f, 0.0f}));
  EXPECT_THAT(red.notes, testing::IsEmpty());
  EXPECT_THAT(read(test::jpeg({128}, false)).notes, testing::IsEmpty());
  EXPECT_THAT(read(test::jpeg({0, 127, 255, 255}, true)).notes, testing::IsEmpty());
  EXPECT_THAT(read(test::jpeg({0, 127, 255, 0}, false)).notes,
              testing::ElementsAre(HasSubstr("is CMYK without Adobe's mark")));
  // A small picture within the file has an end of its own.
  std::string whole = test::jpeg({255, 128, 0}, true);
  whole.insert(2, std::string("\xFF\xE1\0\6\xFF\xD9\xFF\xD9", 8));
  EXPECT_THAT(read(whole).notes, testing::IsEmpty());
  EXPECT_THAT(read(whole + "more").notes, testing::IsEmpty());
  for (const std::size_t cut : {1u, 2u, 4u})
    EXPECT_THAT(read(whole.substr(0, whole.size() - cut)).notes,
                testing::ElementsAre(HasSubstr("ends early")))
        << cut;
}

TEST(ImageReader, AnyNameIsAName) {
  for (const char* name : {"a?b.tga", "what?.tga", "50% #1 ?x=2&y.tga"})
    EXPECT_EQ(error_of(read_image(write_targa(name, 1, 1, 3, {255, 0, 0}))), "none") << name;
}

TEST(ImageReader, SaysWhatIsWrong) {
  EXPECT_THAT(error_of(read_image("/no/such.png")),
              HasSubstr("/no/such.png: missing: expected an image file"));
  EXPECT_THAT(error_of(read_image(testing::TempDir())), HasSubstr("is a folder, expected a file"));
  const std::string text = write_test_file("text.png", "this is no image\n");
  EXPECT_THAT(error_of(read_image(text)), HasSubstr("text.png: not an image: "));
  const std::string cut =
      write_test_file("cut.tga", test::targa(64, 64, 3, std::vector<std::uint8_t>(300)));
  EXPECT_THAT(error_of(read_image(cut)), HasSubstr("cut.tga: not an image: "));
  EXPECT_THAT(error_of(read_image(write_test_file("wide.tga", test::targa(9000, 1, 3, {})))),
              HasSubstr("wide.tga: expected an image of 1 to 8192 pixels a side, got 9000 x 1"));
  const Bytes bytes(100, std::byte{1});
  EXPECT_EQ(error_of(read_image(bytes, "set.glb, image 2")),
            "set.glb, image 2: not an image: expected PNG, JPEG or WebP");
  const Bytes png{std::byte{0x89}, std::byte{'P'}, std::byte{'N'}, std::byte{'G'}, std::byte{13}};
  EXPECT_THAT(error_of(read_image(png, "set.glb, image 3")),
              HasSubstr("set.glb, image 3: not an image: "));
}

}  // namespace
}  // namespace baton
