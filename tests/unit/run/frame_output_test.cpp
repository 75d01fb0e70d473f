#include "worker/run/frame_output.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/base/version.h"
#include "common/image/noise.h"
#include "common/job/plan/sequence.h"
#include "common/job/text/frame_range.h"

namespace baton {
namespace {

JobSpec small_job(const std::string& name) {
  JobSpec job;
  job.sampling.method = Method::sequential;
  job.name = "small";
  job.frames = parse_frames("7,9").value();
  job.environment.keys = {{.frame = 1, .map = "sky.exr"}};
  job.image = {.width = 20, .height = 10, .sites = 1, .tile_size = 8};
  job.output.directory = testing::TempDir() + "frame_output_" + name;
  return job;
}

/// A value that tells channel and pixel apart, not exact in half.
float value_at(std::size_t channel, int x, int y) {
  return 0.1f * static_cast<float>(channel) + static_cast<float>(x) +
         1.0f / static_cast<float>(y + 3);
}

FilmTile make_tile(const PixelRect& rect) {
  FilmTile tile{.rect = rect, .channels = {"R", "G", "B"}, .values = {}};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (int y = rect.y0; y < rect.y1; ++y) {
      for (int x = rect.x0; x < rect.x1; ++x) tile.values.push_back(value_at(channel, x, y));
    }
  }
  return tile;
}

FilmTile assembled(const JobSpec& job) {
  FilmTile image = blank_image(job.image.rendered(), {"R", "G", "B"});
  const TileGrid grid(job.image);
  for (std::int32_t tile = 0; tile < grid.count(); ++tile) {
    EXPECT_TRUE(paste_tile(make_tile(grid.rect(tile)), image));
  }
  return image;
}

TEST(FrameOutput, TilesMakeTheWholePicture) {
  const JobSpec job = small_job("whole");
  EXPECT_EQ(assembled(job), make_tile({0, 0, 20, 10}));
}

TEST(FrameOutput, AFrameIsWrittenVerifiedAndNamedByItsDigest) {
  JobSpec job = small_job("written");
  job.metadata["owner"] = "lighting";
  job.environment = {.keys = {{.frame = 1, .map = "dawn.exr"}, {.frame = 11, .map = "noon.exr"}},
                     .rotation_start_deg = 5,
                     .rotation_deg_per_frame = 1.5};
  job.seed = 77;
  job.output.frames_per_second = 23.976;
  const Digest digest{3, 4};
  const Result<WrittenFrame> written = write_frame(job, digest, FrameIndex(1), assembled(job));
  ASSERT_TRUE(written) << written.error().message;
  const BlobRef* const ref = &written->file;
  EXPECT_EQ(ref->kind, BlobKind::image);
  EXPECT_EQ(ref->frame(), FrameIndex(1));
  EXPECT_EQ(written->quality.pixels, 200u);
  EXPECT_EQ(written->quality.noise_source, NoiseSource::none);

  const std::filesystem::path path = frame_path(job, FrameIndex(1));
  EXPECT_EQ(path.filename(), "frame.0009.exr");
  const Bytes bytes = read_file(path, limits::kMaxBlobBytes).value();
  EXPECT_EQ(ref->digest, digest_of(bytes));
  EXPECT_EQ(ref->size_bytes, bytes.size());

  const ImageMetadata metadata = read_exr_metadata(path).value();
  EXPECT_THAT(metadata, testing::IsSupersetOf(ImageMetadata{{"baton:version", kVersion},
                                                            {"baton:jobName", "small"},
                                                            {"baton:jobDigest", digest.hex()},
                                                            {"baton:frame", "9"},
                                                            {"baton:method", "sequential"},
                                                            {"baton:seed", "77"},
                                                            {"baton:sites", "1"},
                                                            {"baton:rounds", "1"},
                                                            {"baton:numParticles", "16"},
                                                            {"baton:map", "dawn.exr"},
                                                            {"baton:mapMixedIn", "noon.exr"},
                                                            {"baton:mapMix", "0.8"},
                                                            {"baton:rotationDeg", "17"},
                                                            {"baton:pixelsBelowZero", "0"},
                                                            {"framesPerSecond", "24000/1001"},
                                                            {"baton:metadata:owner", "lighting"}}));
  EXPECT_TRUE(std::any_of(metadata.begin(), metadata.end(), [](const auto& entry) {
    return entry.first == "worldToCamera" && entry.second == "1 0 0 0 0 1 0 0 0 0 1 0 0 0 -5 1";
  })) << "the camera stands at (0, 0, 5)";
}

TEST(FrameOutput, WhatFilmsAloneHaveIsInNoFrame) {
  JobSpec job = small_job("hidden");
  job.visibility.correlated = true;
  job.light.bounces = 1;
  FilmTile image = blank_image(job.image.rendered(),
                               {"R", "G", "B", "A", "indirect.R", "indirect.G", "indirect.B"});
  for (const bool wanted : {false, true}) {
    if (wanted) job.output.aovs = {Aov::indirect};
    ASSERT_TRUE(write_frame(job, {3, 4}, FrameIndex(0), image));
    const auto frame = read_exr(frame_path(job, FrameIndex(0)).string());
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->find("indirect.G") != nullptr, wanted);
  }
}

TEST(FrameOutput, AWrongValueIsFoundInTheFrameThatLooksAtItsBlock) {
  JobSpec job = small_job("verified");
  job.image.height = 40;
  const FilmTile image = make_tile({0, 0, 20, 40});
  ASSERT_TRUE(write_frame(job, {3, 4}, FrameIndex(0), image));
  for (const std::size_t row : {0, 15, 16, 31, 32, 39}) {
    FilmTile other = image;
    other.plane(2)[row * 20 + 7] += 1;
    for (std::int32_t frame = 0; frame < 7; ++frame) {
      const Status status = verify_frame(frame_path(job, FrameIndex(0)), other, frame);
      const bool looks_there = static_cast<std::size_t>(frame % 3) == row / 16;
      EXPECT_EQ(status.ok(), !looks_there) << row << " in frame " << frame;
      if (status) continue;
      EXPECT_EQ(status.error().kind, ErrorKind::corrupt);
      EXPECT_THAT(status.error().message,
                  testing::HasSubstr(fmt::format("channel B pixel 7,{}", row)));
    }
  }
}

TEST(FrameOutput, AFrameOfOtherSizeOrChannelsIsNotTheFrame) {
  const JobSpec job = small_job("shape");
  const FilmTile image = assembled(job);
  ASSERT_TRUE(write_frame(job, {3, 4}, FrameIndex(0), image));
  EXPECT_TRUE(verify_frame(frame_path(job, FrameIndex(0)), image, 0));
  EXPECT_FALSE(verify_frame(frame_path(job, FrameIndex(0)), make_tile({0, 0, 19, 10}), 0));
  EXPECT_FALSE(verify_frame(frame_path(job, FrameIndex(0)), make_tile({0, 0, 20, 11}), 0));
  FilmTile renamed = image;
  renamed.channels[1] = "Z";
  EXPECT_FALSE(verify_frame(frame_path(job, FrameIndex(0)), renamed, 0));
}

TEST(FrameOutput, EqualFramesAreEqualFiles) {
  const JobSpec job = small_job("equal");
  const WrittenFrame first = write_frame(job, {3, 4}, FrameIndex(0), assembled(job)).value();
  const WrittenFrame again = write_frame(job, {3, 4}, FrameIndex(0), assembled(job)).value();
  EXPECT_EQ(again.file, first.file);
  EXPECT_EQ(again.quality, first.quality);
}

TEST(FrameOutput, ValuesBelowZeroAreSetToZeroAndCounted) {
  JobSpec job = small_job("negative");
  FilmTile image = assembled(job);
  image.plane(0)[5] = -4.5f;
  image.plane(2)[5] = -1;
  image.plane(1)[77] = -0.25f;
  for (const bool clamp : {true, false}) {
    job.output.clamp_negative = clamp;
    const FrameQuality seen = write_frame(job, {3, 4}, FrameIndex(0), image).value().quality;
    EXPECT_EQ(seen.pixels_below_zero, 2u);
    EXPECT_EQ(seen.lowest, -4.5f);
    EXPECT_EQ(seen.clamped, clamp);
    const FilmTile stored = read_exr(frame_path(job, FrameIndex(0))).value();
    EXPECT_EQ(stored.find("R")[5], clamp ? 0.0f : -4.5f);
    EXPECT_EQ(stored.find("G")[77], clamp ? 0.0f : -0.25f);
    EXPECT_NEAR(stored.find("G")[5], image.plane(1)[5], 0.01f) << "what is not below zero stays";
  }
}

TEST(FrameOutput, APlateKeepsItsValuesBelowZeroAndIsNotCounted) {
  JobSpec job = small_job("composite");
  job.output.pixel_type = PixelType::full_float;
  FilmTile image{.rect = {0, 0, 20, 10}, .channels = {"R", "G", "B", "A"}, .values = {}};
  image.values.resize(4 * image.num_pixels());  // sees nothing but
  for (const std::size_t i : {5u, 6u}) {        // two pixels
    for (std::size_t c = 0; c < 3; ++c) image.plane(c)[i] = 0.5f;
    image.find("A")[i] = 1;
  }
  image.find("R")[5] = -0.25f;
  RgbImage plate{20, 10, std::vector<float>(600, 1.0f)};
  for (std::size_t i = 0; i < 200; ++i) plate.rgb[3 * i] = -0.125f;
  for (const bool clamp : {true, false}) {
    job.output.clamp_negative = clamp;
    const FrameQuality seen = write_frame(job, {3, 4}, FrameIndex(0), image, plate).value().quality;
    EXPECT_EQ(seen.pixels_below_zero, 1u);
    EXPECT_EQ(seen.lowest, -0.25f);
    EXPECT_EQ(seen.pixels_not_finite, 0u);
    // The plate shows in 198 pixels.
    const float light = 198 * (2 - 0.125f) + 5 * 0.5f + (clamp ? 0.0f : -0.25f);
    EXPECT_NEAR(seen.mean, light / 600, 1e-6f);
    EXPECT_NEAR(seen.light_below_zero, 0.25f / light, 1e-7f);
    const FilmTile stored = read_exr(frame_path(job, FrameIndex(0))).value();
    EXPECT_EQ(stored.find("R")[5], clamp ? 0.0f : -0.25f);
    EXPECT_EQ(stored.find("R")[6], 0.5f);
    EXPECT_EQ(stored.find("R")[7], -0.125f);
    EXPECT_EQ(stored.find("G")[7], 1.0f);
  }
}

TEST(FrameOutput, ColoursPastAHalfFloatAreWrittenAsFloat) {
  const JobSpec job = small_job("bright");
  FilmTile image = assembled(job);
  ASSERT_EQ(write_frame(job, {3, 4}, FrameIndex(0), image).value().quality.pixels_beyond_half, 0u);
  EXPECT_NE(read_exr(frame_path(job, FrameIndex(0))).value().find("G")[9], image.plane(1)[9])
      << "half";
  image.plane(0)[5] = 1e6f;
  ASSERT_EQ(write_frame(job, {3, 4}, FrameIndex(0), image).value().quality.pixels_beyond_half, 1u);
  const FilmTile stored = read_exr(frame_path(job, FrameIndex(0))).value();
  EXPECT_EQ(stored.find("R")[5], 1e6f);
  EXPECT_EQ(stored.find("G")[9], image.plane(1)[9]) << "the other colours, too";
}

TEST(FrameOutput, ErrorsTellTheNoiseAndStayOutOfTheFrame) {
  const JobSpec job = small_job("error");
  FilmTile image = assembled(job);
  image.channels.insert(image.channels.begin() + 1, kErrorChannel);
  image.values.insert(image.values.begin() + 200, 200, 0.04f);
  const FrameQuality seen = write_frame(job, {3, 4}, FrameIndex(0), image).value().quality;
  EXPECT_EQ(seen.noise_source, NoiseSource::scatter);
  EXPECT_NEAR(seen.noise, 0.2f / seen.mean, 1e-4f);
  const FilmTile stored = read_exr(frame_path(job, FrameIndex(0))).value();
  EXPECT_EQ(stored.find(kErrorChannel), nullptr);
  EXPECT_NEAR(stored.find("G")[9], image.find("G")[9], 0.01f);
}

TEST(FrameOutput, AFolderThatCannotBeMadeIsAnErrorWithItsName) {
  JobSpec job = small_job("blocked");
  job.output.directory = "/dev/null/frames";
  const Result<WrittenFrame> ref = write_frame(job, {3, 4}, FrameIndex(0), assembled(job));
  ASSERT_FALSE(ref);
  EXPECT_THAT(ref.error().message, testing::HasSubstr("/dev/null/frames"));
}

}  // namespace
}  // namespace baton
