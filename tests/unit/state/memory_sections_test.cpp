// What pixels remember, in a file and back.
#include "common/state/memory_plane.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/state/state_files.h"

namespace baton {
namespace {

using testing::HasSubstr;

/// Three pixels in two blocks: one has seen a ray in two of its bins.
SampleState remembering_state(std::int32_t num_particles = 2) {
  SampleState state = tiny_state();
  state.resize(memory_format(), {2, 0, 5, 1}, num_particles);
  state.source[1] = state.source[2] = PixelSource::carried;
  pixel_memory_plane(state)[1].lobe_noise = 0x3C01;
  pixel_memory_plane(state)[1].rays[1] = {500, RayTally::kMost};
  pixel_memory_plane(state)[2].light_noise = 0x3B12;
  block_memory_plane(state)[1].cells[5] = {12, 3};
  block_memory_plane(state)[1].cells[BlockMemory::kCount - 1] = {255, 255};
  return state;
}

TEST(SampleState, RemembersRays) {
  const SampleState state = remembering_state();
  EXPECT_EQ(*decode_state(encode_state(state), "test"), state);
}

TEST(SampleState, RemembersEveryBin) {
  SampleState state = remembering_state();
  for (const std::size_t step : {1, 2, 3, 31, 63, 511}) {
    BlockMemory& memory = block_memory_plane(state)[0];
    memory = {};
    for (std::size_t bin = 0; bin < BlockMemory::kCount; bin += step)
      memory.cells[bin] = {static_cast<std::uint8_t>(1 + bin % 255), 1};
    EXPECT_EQ(*decode_state(encode_state(state), "test"), state) << step;
  }
}

TEST(SampleState, RefusesMasksThatNameOtherCells) {
  SectionFile file = sections_of(remembering_state());
  section(file, "BLKM").payload[7] = std::byte{0x80};
  EXPECT_THAT(error_of(file).message, HasSubstr("section BLKC has 4 bytes, expected 6"));
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
  EXPECT_EQ(raw_bytes(state, "BLKM"), 2 * 64u);
  EXPECT_EQ(raw_bytes(state, "BLKC"), 4u);
  EXPECT_EQ(raw_bytes(state, "NOIS"), 4u);
  EXPECT_EQ(raw_bytes(state, "NOIL"), 4u);
  state.resize(sample_format(), state.rect, 2);
  EXPECT_EQ(raw_bytes(state, "BLKC"), 0u);
}

TEST(SampleState, RemembersRaysOfCatchersApart) {
  SampleState state = remembering_state();
  state.resize(memory_format(true), state.rect, 0);
  state.source[1] = PixelSource::catcher;
  block_memory_plane(state, 1)[1].cells[9] = {7, 7};
  block_memory_plane(state)[0].cells[8] = {3, 0};
  EXPECT_EQ(*decode_state(encode_state(state), "test"), state);
}

TEST(SampleState, RefusesCountsThatCannotBe) {
  for (const auto& [cell, said] : {std::pair(VisibilityCell{3, 4}, "4 of 3 rays are free"),
                                   std::pair(VisibilityCell{0, 0}, "0 of 0 rays are free")}) {
    SectionFile file = sections_of(remembering_state());
    section(file, "BLKC").payload[0] = std::byte{cell.seen};
    section(file, "BLKC").payload[1] = std::byte{cell.free};
    EXPECT_THAT(error_of(file).message,
                HasSubstr(fmt::format("section BLKC: pixel (4, 0): {}", said)));
  }
}

TEST(MemoryFormat, ABlockInheritsHalfOfTheMeanOfItsSources) {
  SampleState old;
  old.resize(memory_format(), {0, 0, 8, 4}, 0);
  block_memory_plane(old)[0].cells[7] = {100, 60};
  block_memory_plane(old)[1].cells[7] = {20, 20};
  block_memory_plane(old)[1].cells[300] = {255, 1};
  SampleState now;
  now.resize(memory_format(), {0, 0, 4, 4}, 0);
  const StateFormat::BlockSource sources[] = {{&old, 0, 0, 3}, {&old, 1, 0, 1}};
  memory_format().inherit_block(sources, now, 0);
  EXPECT_EQ(block_memory_plane(now)[0].cells[7], (VisibilityCell{40, 25}));
  EXPECT_EQ(block_memory_plane(now)[0].cells[300], (VisibilityCell{31, 0}));
  EXPECT_EQ(block_memory_plane(now)[0].cells[8], VisibilityCell());
}

// Everything moves by a block: blocks of objects inherit from those of objects, and so do those of
// catchers, whatever the other plane has at the same place.
TEST(MemoryFormat, CatchersInheritFromCatchers) {
  SampleState old, now;
  for (SampleState* state : {&old, &now}) state->resize(memory_format(true), {0, 0, 12, 4}, 0);
  for (std::size_t block = 0; block < 3; ++block) {
    const auto number = static_cast<std::uint8_t>(10 * block + 10);
    block_memory_plane(old, 0)[block].cells[5] = {number, number};
    block_memory_plane(old, 1)[block].cells[6] = {static_cast<std::uint8_t>(number + 100), 2};
  }
  const StateFormat::BlockSource to_first[] = {{&old, 1, 0, 16}};
  const StateFormat::BlockSource to_second[] = {{&old, 2, 1, 9}, {&old, 2, 0, 7}};
  memory_format(true).inherit_block(to_first, now, 0);
  memory_format(true).inherit_block(to_second, now, 1);
  EXPECT_EQ(block_memory_plane(now, 0)[0].cells[5], (VisibilityCell{10, 10}));
  EXPECT_EQ(block_memory_plane(now, 1)[0], BlockMemory());
  EXPECT_EQ(block_memory_plane(now, 0)[1].cells[5], (VisibilityCell{15, 15}));
  EXPECT_EQ(block_memory_plane(now, 1)[1].cells[6], (VisibilityCell{65, 1}));
  EXPECT_EQ(block_memory_plane(now, 0)[1].cells[6], VisibilityCell());
  EXPECT_EQ(block_memory_plane(now, 0)[2], BlockMemory());
}

// Whatever a block's pixels come from: half of the mean, rounded down, is at most one less, and no
// bin has more free rays than rays.
TEST(MemoryFormat, AMeanIsRoundedDown) {
  SampleState old, now;
  old.resize(memory_format(), {0, 0, 12, 4}, 0);
  now.resize(memory_format(), {0, 0, 4, 4}, 0);
  for (std::int32_t a = 0; a <= 14; ++a) {
    for (std::int32_t b = 0; a + b <= 15; ++b) {
      for (const VisibilityCell cell : {VisibilityCell{255, 255}, {255, 254}, {1, 1}, {7, 6}}) {
        for (BlockMemory& memory : block_memory_plane(old)) memory.cells[0] = cell;
        const StateFormat::BlockSource sources[] = {
            {&old, 0, 0, a}, {&old, 1, 0, b}, {&old, 2, 0, 16 - a - b}};
        memory_format().inherit_block(sources, now, 0);
        const VisibilityCell half = block_memory_plane(now)[0].cells[0];
        EXPECT_LE(half.seen, cell.seen / 2);
        EXPECT_GE(half.seen + 1, cell.seen / 2);
        EXPECT_LE(half.free, half.seen);
      }
    }
  }
}

TEST(SampleState, RefusesTalliesPastTheMost) {
  SampleState state = remembering_state();
  pixel_memory_plane(state)[2].rays[0].expected = RayTally::kMost + 1;
  const auto decoded = decode_state(encode_state(state), "a.bst");
  ASSERT_FALSE(decoded.ok());
  EXPECT_THAT(decoded.error().message,
              HasSubstr("a.bst: section TLLY: pixel (4, 0): 32513, expected at most 32512"));
}

TEST(SampleState, RefusesNoiseThatIsNoNumber) {
  const std::pair<std::uint16_t PixelMemory::*, const char*> kinds[] = {
      {&PixelMemory::light_noise, "NOIS"}, {&PixelMemory::lobe_noise, "NOIL"}};
  for (const auto& [kind, section] : kinds) {
    for (const std::uint16_t noise :
         {std::uint16_t{0x7F80}, std::uint16_t{0x8001}}) {  // infinite, negative
      SampleState state = remembering_state();
      pixel_memory_plane(state)[2].*kind = noise;
      const auto decoded = decode_state(encode_state(state), "a.bst");
      ASSERT_FALSE(decoded.ok());
      EXPECT_THAT(decoded.error().message,
                  HasSubstr(fmt::format(
                      "a.bst: section {}: pixel (4, 0): noise {:#06x}, expected 0 to 0x7f7f",
                      section, noise)));
    }
  }
}

}  // namespace
}  // namespace baton
