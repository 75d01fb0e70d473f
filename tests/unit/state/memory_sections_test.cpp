// What pixels remember, in a file and back.
#include "common/state/memory_plane.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/state/state_files.h"

namespace baton {
namespace {

using testing::HasSubstr;

/// One surface pixel whose rays agree, one whose rays do not.
SampleState remembering_state(std::int32_t num_particles = 2) {
  SampleState state = tiny_state();
  state.resize(memory_format(), {0, 0, 3, 1}, num_particles);
  state.source[1] = state.source[2] = PixelSource::carried;
  PixelMemory& agreed = memory_plane(state)[1];
  agreed.all_rays = 0x8003;
  agreed.outcomes = PixelMemory::kSawFree;
  agreed.lobe_noise = 0x3C01;
  PixelMemory& disagreed = memory_plane(state)[2];
  disagreed.bins.cells[5] = 0x1234;
  disagreed.all_rays = 0x7771;
  disagreed.outcomes = PixelMemory::kSawBoth;
  disagreed.light_noise = 0x3B12;
  return state;
}

TEST(SampleState, RemembersRays) {
  const SampleState state = remembering_state();
  EXPECT_EQ(*decode_state(encode_state(state), "test"), state);
}

TEST(SampleState, RemembersEveryBin) {
  SampleState state = remembering_state();
  for (const std::size_t step : {1, 2, 3, 31, 63}) {
    PixelMemory& memory = memory_plane(state)[2];
    memory.bins = {};
    for (std::size_t bin = 0; bin < VisibilityBins::kCount; bin += step)
      memory.bins.cells[bin] = static_cast<VisibilityCell>(0x1001 + bin);
    EXPECT_EQ(*decode_state(encode_state(state), "test"), state) << step;
  }
}

TEST(SampleState, RefusesMasksThatNameOtherCells) {
  SectionFile file = sections_of(remembering_state());
  section(file, "VISM").payload[7] = std::byte{0x80};
  EXPECT_THAT(error_of(file).message, HasSubstr("section VISC has 2 bytes, expected 4"));
}

TEST(SampleState, KeepsConfidences) {
  SampleState state = remembering_state();
  state.resize(weighed_sample_format(), state.rect, 2);
  state.source[1] = state.source[2] = PixelSource::carried;
  confidence_plane(state)[1] = 1;
  confidence_plane(state)[2] = 1000;
  EXPECT_EQ(*decode_state(encode_state(state), "test"), state);
}

TEST(SampleState, NeedsNoParticlesBesideAMemory) {
  SampleState state = remembering_state(0);
  EXPECT_EQ(*decode_state(encode_state(state), "test"), state);
  state.resize(sample_format(), state.rect, 0);
  const auto decoded = decode_state(encode_state(state), "a.bst");
  ASSERT_FALSE(decoded.ok());
  EXPECT_THAT(decoded.error().message, HasSubstr("section META: 0 particles, expected 1 to 64"));
}

TEST(SampleState, StoresOnlyBinsThatRaysReached) {
  SampleState state = remembering_state();
  const auto raw_bytes = [](const SampleState& s, const std::string& tag) {
    const auto sections = *state_sections(encode_state(s), "test");
    for (const SectionInfo& section : sections) {
      if (tag_text(section.tag) == tag) return section.raw_bytes;
    }
    return std::uint64_t{0};
  };
  EXPECT_EQ(raw_bytes(state, "VISM"), 8u);
  EXPECT_EQ(raw_bytes(state, "VISC"), 2u);
  EXPECT_EQ(raw_bytes(state, "VISS"), 8u);
  EXPECT_EQ(raw_bytes(state, "NOIS"), 4u);
  EXPECT_EQ(raw_bytes(state, "NOIL"), 4u);
  state.resize(sample_format(), state.rect, 2);
  EXPECT_EQ(raw_bytes(state, "VISS"), 0u);
}

TEST(SampleState, RefusesOutcomesThatCannotBe) {
  SampleState state = remembering_state();
  memory_plane(state)[1].outcomes = 4;
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
      memory_plane(state)[2].*kind = noise;
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
