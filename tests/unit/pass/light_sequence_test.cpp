// What the light of a long sequence takes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "common/job/text/frame_range.h"
#include "tests/support/render_tiled.h"
#include "worker/light/frame_light.h"

namespace baton {
namespace {

/// A dissolve: every frame has a map of its own. checkpoint_every 2: ten frames may be in hand.
JobSpec dissolve(int frames) {
  JobSpec job = test::sequence_job(frames);
  job.environment.keys.push_back({.frame = static_cast<double>(frames),
                                  .map = test::write_map("night.exr", test::sky_map(64, 32, 1))});
  job.state.checkpoint_every = 2;
  return job;
}

// A cache whose values hold those of another keeps more than either may: one map of each frame.
TEST(LightSequence, KeepsTheLightOfTheLastFramesAlone) {
  const JobSpec job = dissolve(60);
  const auto share = std::make_shared<MemoryShare>(std::uint64_t{1} << 30);
  LightSequence lights(job, std::make_shared<MapCache>(share), share);
  std::vector<std::weak_ptr<const EnvironmentMap>> maps;
  std::vector<std::weak_ptr<const PresampledSets>> presampled;
  for (Step step; step < Step(60); ++step) {
    const auto light = lights.at(step);
    ASSERT_TRUE(light.ok());
    ASSERT_TRUE(lights.at(step, kProbeRound).ok());
    maps.push_back((*light)->now.map);
    presampled.push_back((*light)->presampled);
  }
  const auto alive = [](const auto& all) {
    return std::ranges::count_if(all, [](const auto& one) { return !one.expired(); });
  };
  EXPECT_EQ(alive(maps), 12) << "ten, and those of the files";
  EXPECT_EQ(alive(presampled), 10);
}

TEST(LightSequence, MakesAFrameAgainAlike) {
  const JobSpec job = dissolve(60);
  const auto share = std::make_shared<MemoryShare>(std::uint64_t{1} << 30);
  LightSequence lights(job, std::make_shared<MapCache>(share), share);
  auto first = *lights.at(Step(3));
  EXPECT_EQ(*lights.at(Step(3)), first) << "as long as somebody has it";
  const PresampledLight b = first->presampled->sets.front();
  const std::weak_ptr<const PresampledSets> kept = first->presampled;
  first.reset();
  for (Step step(4); step < Step(40); ++step) ASSERT_TRUE(lights.at(step).ok());
  EXPECT_TRUE(kept.expired()) << "it was let go";
  const auto again = *lights.at(Step(3));
  const PresampledLight& a = again->presampled->sets.front();
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  EXPECT_EQ(std::memcmp(a.blocks.data(), b.blocks.data(), b.blocks.size() * sizeof(b.blocks[0])),
            0);
}

// Of maps that were read, each once, and of steps from one of the job's frames to the next.
TEST(LightSequence, NotesWhatIsOdd) {
  JobSpec job = test::sequence_job(8);
  job.frames = parse_frames("1-4,6-9").value();
  job.sampling.method = Method::pool;
  const auto key = [](double frame, const char* name, float radiance, int width) {
    return EnvironmentKey{
        .frame = frame,
        .map = test::write_map(name, {width, 4, std::vector<float>(12u * width, radiance)})};
  };
  job.environment.interpolate = false;
  job.environment.keys = {key(1, "dim.exr", 0.5f, 8),    key(3, "bright.exr", 9, 8),
                          key(5, "dark.exr", 2, 8),      key(7, "square.exr", 9, 4),
                          key(8, "unseen.exr", 0.1f, 8), key(9, "last.exr", 9, 8)};
  const auto share = std::make_shared<MemoryShare>(std::uint64_t{1} << 30);
  LightSequence lights(job, std::make_shared<MapCache>(share), share);
  for (const std::int32_t f : {0, 1, 2, 3, 4, 5}) ASSERT_TRUE(lights.at(Step(f)).ok());
  ASSERT_TRUE(lights.at(Step(5), Round(1)).ok());
  const auto told = [&](const char* text) {
    return std::ranges::count_if(lights.notes(), [&](const std::string& note) {
      return note.find(text) != std::string::npos;
    });
  };
  EXPECT_EQ(told("dim.exr: no texel is brighter than 1 (0.5)"), 1);
  EXPECT_EQ(told("square.exr: 4x4 texels, a lat-long map is twice as wide as high"), 1);
  EXPECT_EQ(told("the light jumps from frame 2 to 3: 18 times as bright"), 1);
  EXPECT_EQ(told("the light jumps from frame 6 to 7: 4.5 times as bright"), 1);
  EXPECT_EQ(told("the light jumps"), 2) << "frame 5 was left out";
  EXPECT_EQ(lights.notes().size(), 4u);
  for (const std::int32_t f : {6, 7}) ASSERT_TRUE(lights.at(Step(f)).ok());
  EXPECT_EQ(told("unseen.exr: no texel"), 1);
  EXPECT_EQ(told("the light jumps"), 3) << "no more than three are told";
}

// A box rises, so that less and less lies behind the ground for all that is lit.
TEST(LightSequence, HidesWhatEachFrameHides) {
  JobSpec job = test::box_job();
  job.frames = test::frame_numbers(3);
  job.scene.objects[1].keys = {{.frame = 2}, {.frame = 3, .translate = {0, 20, 0}}};
  job.motion.max_px = 4;
  const auto scene = load_scene(job);
  ASSERT_TRUE(scene.ok());
  const auto share = std::make_shared<MemoryShare>(std::uint64_t{1} << 30);
  LightSequence lights(job, std::make_shared<MapCache>(share), share,
                       std::make_shared<const HiddenLight>(job, *scene));
  const Vec3 aslant{0.77f, -0.64f, 0};  // by 50 degrees
  const auto first = *lights.at(Step(0)), second = *lights.at(Step(1)), third = *lights.at(Step(2));
  EXPECT_EQ(first->now.map, second->now.map);
  EXPECT_TRUE(second->still);
  EXPECT_TRUE(second->now.evaluate(aslant).is_hidden());
  EXPECT_FALSE(third->now.evaluate(aslant).is_hidden());
  EXPECT_FALSE(third->still) << "what is sampled changes";
  EXPECT_EQ(third->before.map, second->now.map);
}

TEST(LightSequence, TheCameraMaySeeAnotherMap) {
  JobSpec job = test::box_job();
  job.frames = {FrameNumber(7)};
  job.environment.rotation_start_frame = 7;
  job.environment.rotation_start_deg = 90;
  const auto share = std::make_shared<MemoryShare>(std::uint64_t{1} << 30);
  const auto maps = std::make_shared<MapCache>(share);
  const auto plain = *LightSequence(job, maps, share).at(Step(0));
  EXPECT_EQ(plain->seen.map, plain->now.map);
  job.environment.camera_map = {
      .file = test::write_map("plate.exr", test::constant_map(8, 4, {1, 2, 3})), .scale = 3};
  const auto other = *LightSequence(job, maps, share).at(Step(0));
  EXPECT_EQ(other->now.map, plain->now.map);
  EXPECT_EQ(other->seen.rotation, plain->now.rotation);
  EXPECT_EQ(other->seen.evaluate({0, 1, 0}).b, 9);
}

}  // namespace
}  // namespace baton
