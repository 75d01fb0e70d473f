// The step of the pool sampler on a discrete space where everything is known: twelve directions,
// some blocked, light that turns, cuts, goes out and comes back. Chains are independent, so plain
// z-tests apply.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "tests/support/moments.h"
#include "tests/unit/sampling/discrete_pool.h"

namespace baton::HWY_NAMESPACE {
namespace {

StateValues lobe(std::size_t centre, float base) {
  StateValues t{};
  for (std::size_t i = 0; i < kStates; ++i)
    t[i] = base + ((i + kStates - centre) % kStates < 3 ? 2.0f : 0.0f);
  return t;
}

using Light = std::function<StateValues(int)>;  ///< of a frame, 0-based

/// |z| of Lns and of the image at a frame, and the smallest relative bias of the image that
/// |z| = 4.5 shows.
struct Verdict {
  double lns = 0, image = 0, resolution = 0;
};

using test::Moments;

Verdict run(const Light& light, int frame, int chains, Fault fault = Fault::none) {
  const StateValues last = light(frame - 1);
  double lns = 0, image = 0;
  for (std::size_t i = 0; i < kStates; ++i) {
    lns += last[i];
    image += last[i] * kVisible[i];
  }
  const auto space = std::make_unique<PoolSpace>();
  Moments lns_moments, image_moments;
  for (int c = 0; c < chains; ++c) {
    PoolChain chain(static_cast<std::uint64_t>(c) + 1, *space, fault);
    FrameEstimate e;
    for (int f = 0; f < frame; ++f) e = chain.step(light(f));
    lns_moments.add(e.lns);
    image_moments.add(e.image);
  }
  return {lns_moments.z(lns), image_moments.z(image),
          image > 0 ? 4.5 * image_moments.error() / image : 0};
}

const Light kTurning = [](int f) { return lobe(static_cast<std::size_t>(f / 3) % kStates, 0.2f); };

/// Light in half shadow, where a memory never settles.
const Light kPenumbra = [](int) {
  StateValues t;
  t.fill(0.05f);
  t[7] = 2;
  return t;
};

/// One bright direction, in the open.
const Light kLamp = [](int) {
  StateValues t;
  t.fill(0.05f);
  t[0] = 2;
  return t;
};

struct Case {
  const char* name;
  Light light;
};
const std::vector<Case> kCases{
    {"still", [](int) { return lobe(2, 0.2f); }},
    {"turning", kTurning},
    {"half shadow", kPenumbra},
    {"lamp", kLamp},
    {"cuts", [](int f) { return f % 5 == 4 ? lobe(8, 0.0f) : lobe(1, 0.3f); }},
    {"black to lit", [](int f) { return f % 4 < 2 ? StateValues{} : lobe(6, 0.1f); }},
    {"growing support", [](int f) {
       StateValues t{};
       for (std::size_t i = 0; i < kStates; ++i) t[i] = static_cast<int>(i) <= f % 12 ? 1.0f : 0.0f;
       return t;
     }}};

// Hypothesis: E[Lns^] = Lns and E[image] = image at frames 1, 5, 20 and 100 of seven lights. 56
// z-tests at level 1e-3 with Sidak: |z| < 4.3, here 4.5; 60000 to 2300 chains resolve a bias of
// at most 12 % of the image.
TEST(Pool, IsUnbiasedAtEveryFrame) {
  for (const Case& c : kCases) {
    for (const int frame : {1, 5, 20, 100}) {
      const Verdict v = run(c.light, frame, 240000 / (frame + 3));
      EXPECT_LT(v.lns, 4.5) << c.name << " frame " << frame;
      EXPECT_LT(v.image, 4.5) << c.name << " frame " << frame;
      EXPECT_LT(v.resolution, 0.12) << c.name << " frame " << frame;
    }
  }
}

TEST(Pool, ShadesEitherWayWithFewAndMany) {
  const auto space = std::make_unique<PoolSpace>();
  PoolChain chain(1, *space);
  for (int f = 0; f < 100; ++f) chain.step(lobe(f < 50 ? 0 : 4, 0.2f));
  EXPECT_GE(chain.with_control, 90);
  EXPECT_GE(chain.without_control, 4);
  EXPECT_LT(chain.fewest_rays, std::size_t{kRays});
  EXPECT_GT(chain.most_rays, std::size_t{kRays});
  EXPECT_LT(chain.fewest_candidates, kCandidates);
  EXPECT_GT(chain.most_candidates, kCandidates);
}

TEST(Pool, RaysGoWhereTheDeviationIs) {
  const auto rays = [](std::int32_t num_rays, float deviation, float scale) {
    return rays_for_deviation({}, num_rays, deviation, scale);
  };
  EXPECT_EQ(rays(16, 0.025f, 1), 16);
  EXPECT_EQ(rays(16, 0.001f, 1), 8);
  EXPECT_EQ(rays(16, 3, 60), 32);
  EXPECT_EQ(rays(16, 30, 60), 64);
  EXPECT_EQ(rays(64, 0.5f, 1), 64);
  EXPECT_EQ(rays(1, 0.0f, 1), 1);
}

// Hypothesis: E[image] = image though the block has learnt from a neighbour in this frame: whatever
// it says before a pixel chooses its rays, these add up to the light that is free. 8 z-tests, |z| <
// 4.5; the resolution is that of the test above.
TEST(Pool, ANeighboursRaysOfThisFrameAreNoBias) {
  for (const Light& light : {kTurning, kPenumbra, kLamp, kCases[0].light}) {
    for (const int frame : {5, 20}) {
      const Verdict v = run(light, frame, 120000 / (frame + 3), Fault::rays_of_a_neighbour);
      EXPECT_LT(v.lns, 4.5) << frame;
      EXPECT_LT(v.image, 4.5) << frame;
      EXPECT_LT(v.resolution, 0.12) << frame;
    }
  }
}

// The same machinery must see each way to spoil it.
TEST(Pool, VisibilityOfThisFramesRaysIsSeen) {
  EXPECT_GT(run(kPenumbra, 10, 6000, Fault::rays_of_this_frame).image, 4.5);
}
TEST(Pool, CandidatesByTheirOwnNoiseAreSeen) {
  EXPECT_GT(run(kLamp, 10, 6000, Fault::candidates_by_noise_of_this_frame).lns, 4.5);
}
TEST(Pool, RaysAddedByOutcomeAreSeen) {
  EXPECT_GT(run(kPenumbra, 10, 12000, Fault::more_rays_after_a_blocked_one).image, 4.5);
}

}  // namespace
}  // namespace baton::HWY_NAMESPACE
