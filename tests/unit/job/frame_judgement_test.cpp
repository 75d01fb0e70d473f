#include "common/job/plan/frame_judgement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace baton {
namespace {

std::vector<FrameReport> sequence(std::size_t count, float noise = 0.04f, float mean = 1) {
  std::vector<FrameReport> frames(count);
  for (std::size_t i = 0; i < count; ++i) {
    frames[i].frame = FrameNumber(static_cast<std::int32_t>(i + 1));
    frames[i].sampling.pixels_carried = 90;
    const float wobble = i % 2 == 0 ? 1.02f : 0.98f;
    frames[i].quality = {.pixels = 100,
                         .noise_source = NoiseSource::probes,
                         .noise = noise * wobble,
                         .mean = mean * wobble};
  }
  return frames;
}

std::vector<std::int32_t> odd_numbers(const std::vector<FrameReport>& frames) {
  std::vector<std::int32_t> numbers;
  for (const OddFrame& odd : judge_frames(frames).odd)
    numbers.push_back(odd.by_noise ? odd.frame.value() : -odd.frame.value());
  return numbers;
}

TEST(Judgement, SaysHowNoisyTheFramesAre) {
  std::vector<FrameReport> frames = sequence(12);
  frames[4].quality.noise = 0.09f;
  const Judgement j = judge_frames(frames);
  EXPECT_EQ(j.frames, 12u);
  EXPECT_EQ(j.noisiest, FrameNumber(5));
  EXPECT_FLOAT_EQ(j.noise_most, 0.09f);
  EXPECT_FLOAT_EQ(j.noise_least, 0.04f * 0.98f);
  EXPECT_NEAR(j.noise, std::sqrt((11 * 0.04 * 0.04 + 0.09 * 0.09) / 12), 5e-4);
}

TEST(Judgement, FramesThatStandOutAreNamed) {
  std::vector<FrameReport> frames = sequence(20);
  EXPECT_THAT(odd_numbers(frames), testing::IsEmpty());
  frames[0].quality.noise = 0.095f;  // the first has nothing to go on from
  frames[9].quality.noise = 0.07f;
  frames[14].quality.mean = 3;  // a flash
  frames[16].quality.mean = 0;  // a black frame
  EXPECT_THAT(odd_numbers(frames), testing::ElementsAre(1, 10, -15, -17));
  EXPECT_NEAR(judge_frames(frames).odd[0].ratio, 0.095 / 0.04, 0.1);
}

// A few bright pixels that happen to be looked at are no noisy frame.
TEST(Judgement, NoiseThatIsToldBadlyDoesNotStandOut) {
  std::vector<FrameReport> frames = sequence(20);
  frames[9].quality.noise = 0.08f;
  for (FrameReport& frame : frames) frame.quality.noise_error = 0.1f;
  EXPECT_THAT(odd_numbers(frames), testing::ElementsAre(10));
  frames[9].quality.noise_error = 0.2f;
  EXPECT_THAT(odd_numbers(frames), testing::IsEmpty());
}

TEST(Judgement, CutsAndSteadyChangesDoNotStandOut) {
  std::vector<FrameReport> frames = sequence(20);
  for (std::size_t i = 10; i < 20; ++i) frames[i].quality.mean *= 7;
  EXPECT_THAT(odd_numbers(frames), testing::IsEmpty()) << "a cut";
  frames = sequence(20);
  for (std::size_t i = 0; i < 20; ++i)
    frames[i].quality.mean = frames[i].quality.noise = std::pow(1.3f, static_cast<float>(i));
  EXPECT_THAT(odd_numbers(frames), testing::IsEmpty()) << "dawn";
  frames = sequence(8);
  for (std::size_t i = 0; i < 8; ++i) frames[i].quality.mean = i < 5 ? 0.3f : i == 7 ? 7.0f : 2.0f;
  EXPECT_THAT(odd_numbers(frames), testing::IsEmpty()) << "a sun that comes into view at the end";
}

TEST(Judgement, FramesThatAreNotWrittenAreLeftOut) {
  std::vector<FrameReport> frames = sequence(6);
  frames[3].quality = {};
  frames[5].quality = {};
  EXPECT_EQ(judge_frames(frames).frames, 4u);
  EXPECT_EQ(judge_frames(sequence(0)).frames, 0u);
  EXPECT_THAT(odd_numbers(sequence(3)), testing::IsEmpty()) << "too few to say";
}

TEST(Judgement, OddValuesAreAddedUp) {
  std::vector<FrameReport> frames = sequence(4, 0.04f, 2);
  frames[1].quality.pixels_below_zero = 3;
  frames[1].quality.lowest = -4.4f;
  frames[1].quality.light_below_zero = 0.02f;
  frames[2].quality.pixels_beyond_half = 5;
  frames[2].quality.pixels_not_finite = 7;
  const Judgement j = judge_frames(frames);
  EXPECT_EQ(j.pixels_below_zero, 3u);
  EXPECT_EQ(j.frames_below_zero, 1u);
  EXPECT_EQ(j.lowest, -4.4f);
  EXPECT_NEAR(j.light_below_zero, 0.02 / 4, 2e-4);
  EXPECT_EQ(j.frames_beyond_half, 1u);
  EXPECT_EQ(j.pixels_beyond_half, 5u);
  EXPECT_EQ(j.pixels_not_finite, 7u);
}

TEST(Judgement, AfreshArePixelsThatCouldHaveCarried) {
  std::vector<FrameReport> frames = sequence(3);
  frames[0].sampling = {.pixels_fresh = 90};
  frames[1].sampling.pixels_fresh = 4;
  frames[2].sampling.pixels_restarted = 6;
  frames[2].sampling.pixels_refreshed = 10;  // on schedule
  const Judgement j = judge_frames(frames);
  EXPECT_TRUE(j.carries);
  EXPECT_EQ(j.pixels_afresh, 10u);
  EXPECT_EQ(j.pixels_after_first, 90u + 4 + 90 + 6 + 10);
  for (FrameReport& frame : frames) frame.sampling = {.pixels_fresh = 100};
  EXPECT_FALSE(judge_frames(frames).carries);
}

}  // namespace
}  // namespace baton
