#include "common/state/sample_state.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "common/base/section_file.h"
#include "common/math/philox.h"
#include "tests/unit/state/state_files.h"

namespace baton {
namespace {

using testing::HasSubstr;

/// 64 x 64 pixels of 16 particles as a renderer leaves them after some frames: noisy weights,
/// scattered directions.
SampleState large_state() {
  SampleState state;
  state.resize(sample_format(), {64, 0, 128, 64}, 16);
  const SamplePlanes samples(state);
  for (std::uint32_t pixel = 0; pixel < state.num_pixels(); ++pixel) {
    if (pixel % 64 < 8) continue;
    const Rng rng({.job_seed = 1, .frame = 0, .pixel = pixel}, PassId::move);
    state.source[pixel] = PixelSource::carried;
    samples.lns[pixel] = 0.5f + rng.uniforms(1, 0)[0];
    samples.lns_fresh[pixel] = 0.5f + rng.uniforms(1, 0)[1];
    float sum = 0;
    for (std::uint32_t i = 0; i < 16; ++i) {
      const auto u = rng.uniforms(0, i);
      const std::size_t at = pixel * std::size_t{16} + i;
      samples.direction[at] = encode_octahedral(normalize({u[0] - 0.5f, u[1] - 0.5f, u[2]}));
      samples.weight[at] = u[3];
      samples.site[at] = static_cast<std::uint8_t>(i);
      sum += u[3];
    }
    for (std::uint32_t i = 0; i < 16; ++i) samples.weight[pixel * std::size_t{16} + i] /= sum;
  }
  return state;
}

/// tiny_state with `value` at `offset` of a section's payload.
template <class T>
SectionFile with_value(const std::string& tag, std::size_t offset, T value) {
  SectionFile file = sections_of(tiny_state());
  std::memcpy(section(file, tag).payload.data() + offset, &value, sizeof(value));
  return file;
}

std::string hex(ByteView bytes) {
  std::string text;
  for (const std::byte b : bytes) {
    text += "0123456789abcdef"[std::to_integer<int>(b) >> 4];
    text += "0123456789abcdef"[std::to_integer<int>(b) & 15];
  }
  return text;
}

TEST(SampleState, GivesBackWhatWentIn) {
  for (const SampleState& state : {tiny_state(), large_state()}) {
    const Bytes bytes = encode_state(state);
    const Result<SampleState> decoded = decode_state(bytes, "t.bst");
    ASSERT_TRUE(decoded.ok()) << decoded.error().message;
    EXPECT_TRUE(*decoded == state);
    EXPECT_EQ(encode_state(*decoded), bytes) << "a resume writes the same bytes";
  }
}

TEST(SampleState, AllBackgroundAndUnlitPixelsAreFine) {
  SampleState state;
  state.resize(sample_format(), {0, 0, 3, 3}, 4);
  EXPECT_TRUE(*decode_state(encode_state(state), "t.bst") == state);
  state.source[4] = PixelSource::restarted;
  EXPECT_TRUE(*decode_state(encode_state(state), "t.bst") == state);
}

// The format cannot change unnoticed: these bytes are FORMAT.md by hand. Nothing in so small a
// state shrinks but its equal bytes, so the zstd output is left out: contents are compared
// unpacked.
TEST(SampleState, StoredBytesAreThoseOfTheFormatDocument) {
  const Bytes bytes = encode_state(tiny_state());
  EXPECT_EQ(hex(ByteView(bytes).first(16)),
            "42535431"
            "0100"
            "0700"
            "d8000000"
            "00000000");
  EXPECT_EQ(hex(ByteView(bytes).subspan(16 + 28, 8)),
            "5352435f"
            "03"
            "01"
            "0000")
      << "SRC_, required, raw, stride 1";
  EXPECT_EQ(hex(ByteView(bytes).subspan(16 + 4 * 28, 24)),
            "4449525f"
            "03"
            "01"
            "0000"
            "0800000000000000"
            "0800000000000000");

  SectionFile file = sections_of(tiny_state());
  EXPECT_EQ(hex(section(file, "META").payload),
            "7766554433221100"
            "ffeeddccbbaa9988"
            "05000000"
            "07000000"
            "0a000000"
            "14000000"
            "0c000000"
            "15000000"
            "02000000");
  EXPECT_EQ(hex(section(file, "SRC_").payload), "0002");
  EXPECT_EQ(hex(section(file, "LNS_").payload), "0000c03f");
  EXPECT_EQ(hex(section(file, "LNSF").payload), "00000040");
  EXPECT_EQ(hex(section(file, "DIR_").payload),
            "ff7f0180"
            "78563412");
  EXPECT_EQ(hex(section(file, "WGT_").payload),
            "0000803e"
            "0000403f");
  EXPECT_EQ(hex(section(file, "SITE").payload), "030f");
  // DIR_ in the file: as it is.
  const std::size_t dir_at = 16 + 7 * 28 + 4 + 44 + 2 + 4 + 4;
  EXPECT_EQ(hex(ByteView(bytes).subspan(dir_at, 8)),
            "ff7f0180"
            "78563412");
}

TEST(SampleState, AnyChangedByteIsAnError) {
  const Bytes good = encode_state(tiny_state());
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int flip : {0x01, 0x10, 0x80, 0xFF}) {
      Bytes bad = good;
      bad[i] ^= static_cast<std::byte>(flip);
      EXPECT_FALSE(decode_state(bad, "t.bst").ok()) << "byte " << i << " xor " << flip;
    }
  }
}

TEST(SampleState, AnyTruncationIsAnError) {
  const Bytes good = encode_state(tiny_state());
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(decode_state(ByteView(good).first(size), "t.bst").ok()) << size << " bytes";
  }
}

TEST(SampleState, UnknownSectionsAreSkippedUnlessRequired) {
  SectionFile file = sections_of(tiny_state());
  file.sections.push_back({{'N', 'E', 'W', '_'}, false, 1, Bytes(3)});
  const Result<SampleState> decoded = decode_state(encode_section_file(file), "t.bst");
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_TRUE(*decoded == tiny_state());

  file.sections.back().required = true;
  EXPECT_EQ(error_of(file).kind, ErrorKind::version);
  EXPECT_THAT(error_of(file).message, HasSubstr("t.bst: section NEW_ is required but unknown"));
}

TEST(SampleState, ANewerVersionNamesBoth) {
  SectionFile file = sections_of(tiny_state());
  file.version = kStateVersion + 1;
  EXPECT_EQ(error_of(file).kind, ErrorKind::version);
  EXPECT_EQ(error_of(file).message, "t.bst: version 2, this program reads 1 to 1");
}

TEST(SampleState, EverySectionMustBeThereWithItsSize) {
  const SectionFile good = sections_of(tiny_state());
  for (std::size_t i = 0; i < good.sections.size(); ++i) {
    SectionFile missing = good;
    missing.sections.erase(missing.sections.begin() + static_cast<std::ptrdiff_t>(i));
    EXPECT_THAT(error_of(missing).message,
                HasSubstr("section " + tag_text(good.sections[i].tag) + " is missing"));

    SectionFile longer = good;
    longer.sections[i].payload.resize(longer.sections[i].payload.size() +
                                      longer.sections[i].stride);
    EXPECT_THAT(error_of(longer).message, HasSubstr("bytes, expected"));
  }
}

TEST(SampleState, BadValuesNameSectionAndPixel) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  struct Case {
    SectionFile file;
    const char* message;
  };
  const Case cases[] = {
      {with_value("WGT_", 4, kNan), "section WGT_: pixel (11, 20): particle 1 has weight nan"},
      {with_value("WGT_", 0, -0.25f), "particle 0 has weight -0.25"},
      {with_value("WGT_", 0, kInfinity), "particle 0 has weight inf"},
      {with_value("WGT_", 0, 0.5f), "weights sum to 1.25, expected 1 or 0"},
      {with_value("LNS_", 0, kNan), "section LNS_: pixel (11, 20): nan"},
      {with_value("LNS_", 0, -1.0f), "section LNS_: pixel (11, 20): -1"},
      {with_value("LNSF", 0, kInfinity), "section LNSF: pixel (11, 20): inf"},
      {with_value("SITE", 0, std::uint8_t{16}), "particle 0 has site 16, expected 0 to 15"},
      {with_value("SRC_", 1, std::uint8_t{6}),
       "section SRC_: pixel (11, 20): source 6, expected 0 to 5"},
  };
  for (const Case& c : cases) {
    EXPECT_EQ(error_of(c.file).kind, ErrorKind::bad_input) << c.message;
    EXPECT_THAT(error_of(c.file).message, HasSubstr(c.message));
  }
}

TEST(SampleState, BadMetaIsRefusedBeforeAnythingIsAllocated) {
  struct Case {
    std::size_t offset;
    std::int32_t value;
    const char* message;
  };
  const Case cases[] = {
      {16, -1, "frame index -1"},
      {20, -1, "tile -1"},
      {24, -4097, "rectangle [-4097"},
      {32, 10, "rectangle [10, 10)"},
      {32, 40000, "[10, 40000)"},
      {40, 0, "0 particles"},
      {40, 65, "65 particles, expected 1 to 64"},
      {32, 13, "section SRC_ has 2 bytes, expected 3"},
  };
  for (const Case& c : cases)
    EXPECT_THAT(error_of(with_value("META", c.offset, c.value)).message, HasSubstr(c.message));

  // Each side is within its limit, all of it together is not.
  SectionFile huge = with_value("META", 32, std::int32_t{32768});
  const std::int32_t y1 = 32768;
  std::memcpy(section(huge, "META").payload.data() + 36, &y1, sizeof(y1));
  EXPECT_THAT(error_of(huge).message, HasSubstr("past the limit of"));
}

TEST(SampleState, ListsItsSections) {
  const auto sections = state_sections(encode_state(tiny_state()), "t.bst");
  ASSERT_TRUE(sections.ok()) << sections.error().message;
  ASSERT_EQ(sections->size(), 7u);
  EXPECT_EQ(tag_text((*sections)[0].tag), "META");
  EXPECT_EQ((*sections)[0].raw_bytes, 44u);
  EXPECT_FALSE(state_sections({}, "t.bst").ok());
}

// The target of the design at N = 16, on data without any structure that zstd could use but the
// values' ranges.
TEST(SampleState, TakesAtMost160BytesAPixel) {
  const SampleState state = large_state();
  const double bytes_per_pixel =
      static_cast<double>(encode_state(state).size()) / static_cast<double>(state.num_pixels());
  RecordProperty("bytes_per_pixel", std::to_string(bytes_per_pixel));
  EXPECT_LT(bytes_per_pixel, 160);
}

TEST(SampleState, EqualWeightsPackAway) {
  SampleState state = large_state();
  const std::size_t before = encode_state(state).size();
  for (float& weight : SamplePlanes(state).weight) weight = weight > 0 ? 1.0f / 16 : 0.0f;
  EXPECT_LT(encode_state(state).size() + 40 * state.num_pixels(), before);
}

}  // namespace
}  // namespace baton
