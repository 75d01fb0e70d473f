#include "common/state/sample_state.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "common/base/section_file.h"
#include "common/math/philox.h"

namespace baton {
namespace {

using testing::HasSubstr;

constexpr SectionTag kMagic{'B', 'S', 'T', '1'};

/// A background pixel and a surface pixel of two particles.
SampleState tiny_state() {
  SampleState state;
  state.job_digest = {0x0011223344556677ull, 0x8899aabbccddeeffull};
  state.frame_index = 5;
  state.tile = 7;
  state.resize({10, 20, 12, 21}, 2);
  state.source[1] = PixelSource::carried;
  state.lns[1] = 1.5f;
  state.lns_fresh[1] = 2.0f;
  state.direction[2] = 0x80017fffu;
  state.direction[3] = 0x12345678u;
  state.weight[2] = 0.25f;
  state.weight[3] = 0.75f;
  state.site[2] = 3;
  state.site[3] = 15;
  return state;
}

/// 64 x 64 pixels of 16 particles as a renderer leaves them after some frames: noisy weights,
/// scattered directions.
SampleState large_state() {
  SampleState state;
  state.resize({64, 0, 128, 64}, 16);
  for (std::uint32_t pixel = 0; pixel < state.num_pixels(); ++pixel) {
    if (pixel % 64 < 8) continue;
    const Rng rng({.job_seed = 1, .frame = 0, .pixel = pixel}, PassId::move);
    state.source[pixel] = PixelSource::carried;
    state.lns[pixel] = 0.5f + rng.uniforms(1, 0)[0];
    state.lns_fresh[pixel] = 0.5f + rng.uniforms(1, 0)[1];
    float sum = 0;
    for (std::uint32_t i = 0; i < 16; ++i) {
      const auto u = rng.uniforms(0, i);
      const std::size_t at = pixel * std::size_t{16} + i;
      state.direction[at] = encode_octahedral(normalize({u[0] - 0.5f, u[1] - 0.5f, u[2]}));
      state.weight[at] = u[3];
      state.site[at] = static_cast<std::uint8_t>(i);
      sum += u[3];
    }
    for (std::uint32_t i = 0; i < 16; ++i) state.weight[pixel * std::size_t{16} + i] /= sum;
  }
  return state;
}

/// The container inside a state, to change it with good checksums.
SectionFile sections_of(const SampleState& state) {
  return *decode_section_file(encode_state(state), kMagic, kStateVersion, "t.bst");
}

/// The error that decoding `file` gives; its message is empty when decoding works.
Error error_of(const SectionFile& file) {
  const Result<SampleState> decoded = decode_state(encode_section_file(file), "t.bst");
  return decoded ? Error{ErrorKind::internal, ""} : decoded.error();
}

Section& section(SectionFile& file, const std::string& tag) {
  for (Section& s : file.sections) {
    if (tag_text(s.tag) == tag) return s;
  }
  ADD_FAILURE() << "no section " << tag;
  return file.sections.front();
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
  state.resize({0, 0, 3, 3}, 4);
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
      {with_value("SRC_", 1, std::uint8_t{5}),
       "section SRC_: pixel (11, 20): source 5, expected 0 to 4"},
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
      {24, -1, "rectangle [-1"},
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
  EXPECT_EQ((*sections)[0].tag, "META");
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
  for (float& weight : state.weight) weight = weight > 0 ? 1.0f / 16 : 0.0f;
  EXPECT_LT(encode_state(state).size() + 40 * state.num_pixels(), before);
}

/// One surface pixel whose rays agree, one whose rays do not.
SampleState remembering_state() {
  SampleState state = tiny_state();
  state.resize({0, 0, 3, 1}, 2);
  state.source[1] = state.source[2] = PixelSource::carried;
  state.add_memory();
  PixelMemory& agreed = state.memory[1];
  agreed.all_rays = 0x8003;
  agreed.outcomes = PixelMemory::kSawFree;
  agreed.lobe_noise = 0x3C01;
  PixelMemory& disagreed = state.memory[2];
  disagreed.bins[5] = 0x1234;
  disagreed.all_rays = 0x7771;
  disagreed.outcomes = PixelMemory::kSawBoth;
  disagreed.light_noise = 0x3B12;
  return state;
}

TEST(SampleState, RemembersRays) {
  const SampleState state = remembering_state();
  EXPECT_EQ(*decode_state(encode_state(state), "test"), state);
}

TEST(SampleState, KeepsConfidences) {
  SampleState state = remembering_state();
  state.memory.clear();
  state.add_confidence();
  state.confidence[1] = 1;
  state.confidence[2] = 1000;
  EXPECT_EQ(*decode_state(encode_state(state), "test"), state);
}

TEST(SampleState, NeedsNoParticlesBesideAMemory) {
  SampleState state = remembering_state();
  state.num_particles = 0;
  state.direction.clear();
  state.weight.clear();
  state.site.clear();
  EXPECT_EQ(*decode_state(encode_state(state), "test"), state);
  state.memory.clear();
  const auto decoded = decode_state(encode_state(state), "a.bst");
  ASSERT_FALSE(decoded.ok());
  EXPECT_THAT(decoded.error().message, HasSubstr("section META: 0 particles, expected 1 to 64"));
}

TEST(SampleState, StoresNoGridWhereRaysAgree) {
  SampleState state = remembering_state();
  const auto raw_bytes = [](const SampleState& s, const std::string& tag) {
    const auto sections = *state_sections(encode_state(s), "test");
    for (const StateSectionInfo& section : sections) {
      if (section.tag == tag) return section.raw_bytes;
    }
    return std::uint64_t{0};
  };
  EXPECT_EQ(raw_bytes(state, "VISG"), 512u);
  EXPECT_EQ(raw_bytes(state, "VISS"), 8u);
  EXPECT_EQ(raw_bytes(state, "NOIS"), 4u);
  EXPECT_EQ(raw_bytes(state, "NOIL"), 4u);
  state.memory.clear();
  EXPECT_EQ(raw_bytes(state, "VISS"), 0u);
}

TEST(SampleState, RefusesOutcomesThatCannotBe) {
  SampleState state = remembering_state();
  state.memory[1].outcomes = 4;
  const auto decoded = decode_state(encode_state(state), "a.bst");
  ASSERT_FALSE(decoded.ok());
  EXPECT_THAT(decoded.error().message,
              HasSubstr("a.bst: section VISS: pixel (1, 0): outcomes 4, expected 0 to 3"));
}

TEST(SampleState, RefusesNoiseThatIsNoNumber) {
  const std::pair<std::uint16_t PixelMemory::*, const char*> kinds[] = {
      {&PixelMemory::light_noise, "NOIS"}, {&PixelMemory::lobe_noise, "NOIL"}};
  for (const auto& [kind, section] : kinds) {
    for (const std::uint16_t noise :
         {std::uint16_t{0x7F80}, std::uint16_t{0x8001}}) {  // infinite, negative
      SampleState state = remembering_state();
      state.memory[2].*kind = noise;
      const auto decoded = decode_state(encode_state(state), "a.bst");
      ASSERT_FALSE(decoded.ok());
      EXPECT_THAT(decoded.error().message,
                  HasSubstr(fmt::format(
                      "a.bst: section {}: pixel (2, 0): noise {:#06x}, expected 0 to 0x7f7f",
                      section, noise)));
    }
  }
}

}  // namespace
}  // namespace baton
