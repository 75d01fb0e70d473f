// What the light of a long sequence takes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

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
  std::vector<std::weak_ptr<const PresampledLight>> presampled;
  for (std::int32_t f = 0; f < 60; ++f) {
    const auto light = lights.at(f);
    ASSERT_TRUE(light.ok());
    ASSERT_TRUE(lights.at(f, kProbeRound).ok());
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
  const auto first = *lights.at(3);
  for (std::int32_t f = 4; f < 40; ++f) ASSERT_TRUE(lights.at(f).ok());
  const auto again = *lights.at(3);
  ASSERT_NE(again->presampled, first->presampled) << "it was let go";
  ASSERT_EQ(again->presampled->blocks.size(), first->presampled->blocks.size());
  EXPECT_EQ(std::memcmp(again->presampled->blocks.data(), first->presampled->blocks.data(),
                        first->presampled->size_bytes()),
            0);
}

}  // namespace
}  // namespace baton
