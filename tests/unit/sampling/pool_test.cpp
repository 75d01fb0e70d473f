// The pool sampler on a discrete space where everything is known: twelve directions, some blocked,
// light that turns, cuts, goes out and comes back. Chains are independent, so plain z-tests apply.
#include "worker/sampling/pool.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "common/math/philox.h"
#include "worker/sampling/light_noise.h"

namespace baton {
namespace {

constexpr std::size_t kStates = 12, kCandidates = 12;
constexpr int kRays = 5;
constexpr int kMostCandidates = 48;
constexpr float kMeanRadiance = 12;     // so that pixels get few rays and many
constexpr float kBrightRadiance = 600;  // the same for candidates
using Target = std::array<float, kStates>;

constexpr Target kVisible{1, 1,    1, 0.5f, 0, 0,
                          1, 0.2f, 0, 1,    1, 0.9f};  ///< probability that a ray is free

Target lobe(std::size_t centre, float base) {
  Target t{};
  for (std::size_t i = 0; i < kStates; ++i)
    t[i] = base + ((i + kStates - centre) % kStates < 3 ? 2.0f : 0.0f);
  return t;
}

/// What goes wrong on purpose.
enum class Fault {
  none,
  rays_of_this_frame,
  more_rays_after_a_blocked_one,
  candidates_by_noise_of_this_frame
};

struct Candidate {
  std::size_t state = 0;
  float weight = 0;
};
struct FrameEstimate {
  double lns = 0, image = 0;
};

/// One pixel through the frames, with memory, control variate and numbers of candidates and rays as
/// the product has them.
class Chain {
 public:
  Chain(std::uint64_t seed, Fault fault) : rng_({.job_seed = seed}, PassId::move), fault_(fault) {
    memory_.fill(0.5f);
  }

  int with_control = 0, without_control = 0;                       ///< frames shaded either way
  std::size_t fewest_rays = limits::kMaxParticles, most_rays = 0;  ///< of a frame
  std::size_t fewest_candidates = kMostCandidates, most_candidates = 0;

  FrameEstimate step(const Target& now) {
    // Draw candidates. The fault: their number is decided by what the first of them show.
    float known = variance_;
    if (fault_ == Fault::candidates_by_noise_of_this_frame) {
      const std::uint32_t begin = count_;
      known = variance_of(draw(now, kCandidates));
      count_ = begin;
    }
    const auto count = static_cast<std::size_t>(
        candidates_for_noise(kCandidates, known, kNeedOfLight, kMostCandidates));
    const std::vector<Candidate> candidates = draw(now, count);
    fewest_candidates = std::min(fewest_candidates, count);
    most_candidates = std::max(most_candidates, count);

    FrameEstimate e;
    for (const Candidate& c : candidates) e.lns += c.weight;
    if (e.lns > 0) e.image = shade(candidates, static_cast<float>(e.lns));
    variance_ = variance_of(candidates);
    return e;
  }

 private:
  float uniform() { return rng_.uniforms(0, count_++)[0]; }

  std::vector<Candidate> draw(const Target& now, std::size_t count) {
    std::vector<Candidate> candidates;
    for (std::size_t i = 0; i < count; ++i) {
      const auto state = static_cast<std::size_t>(uniform() * kStates);
      candidates.push_back({state, now[state] * kStates / static_cast<float>(count)});
    }
    return candidates;
  }
  /// light_variance() of candidates.
  static float variance_of(const std::vector<Candidate>& candidates) {
    float light = 0, steps = 0;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      light += candidates[i].weight;
      const float step = i > 0 ? candidates[i].weight - candidates[i - 1].weight : 0.0f;
      steps += step * step;
    }
    const float scale = noise_scale(light, kBrightRadiance);
    return 0.5f * steps / (scale * scale) * static_cast<float>(candidates.size());
  }

  /// Indices of `count` systematic picks.
  std::vector<std::size_t> pick(const std::vector<float>& weight, std::size_t count) {
    float total = 0;
    for (const float w : weight) total += w;
    std::vector<std::size_t> picks;
    const float u = uniform();
    float cumulative = 0;
    for (std::size_t i = 0; i < weight.size(); ++i) {
      cumulative += weight[i];
      while (picks.size() < count &&
             (static_cast<float>(picks.size()) + u) * total / static_cast<float>(count) <
                 cumulative) {
        picks.push_back(i);
      }
    }
    return picks;
  }

  double shade(const std::vector<Candidate>& candidates, float lns) {
    // Choose the way, then the rays.
    float expected = 0, doubt = 0;
    for (const Candidate& c : candidates) {
      expected += c.weight * memory_[c.state];
      doubt += c.weight * doubt_factor(memory_[c.state]);
    }
    const bool control = use_control(expected, doubt);
    const auto factor = [&](float free) {
      return control ? doubt_factor(free) : hope_factor(free);
    };
    std::vector<float> line;
    float total = 0;
    for (const Candidate& c : candidates) {
      line.push_back(c.weight * factor(memory_[c.state]));
      total += line.back();
    }
    auto count =
        static_cast<std::size_t>(rays_for_doubt(kRays, doubt, noise_scale(lns, kMeanRadiance)));
    fewest_rays = std::min(fewest_rays, count);
    most_rays = std::max(most_rays, count);
    std::vector<std::size_t> picks = pick(line, count);

    // Trace and learn. The fault: where the first ray is blocked, as many again are traced.
    Target learnt = memory_;
    std::vector<bool> free;
    const auto trace = [&](std::size_t first) {
      for (std::size_t j = first; j < picks.size(); ++j) {
        const std::size_t state = candidates[picks[j]].state;
        free.push_back(uniform() < kVisible[state]);
        learnt[state] += ((free.back() ? 1.0f : 0.0f) - learnt[state]) / 6;
      }
    };
    trace(0);
    if (fault_ == Fault::more_rays_after_a_blocked_one && !free.front()) {
      const std::vector<std::size_t> more = pick(line, count);
      picks.insert(picks.end(), more.begin(), more.end());
      trace(count);
      count *= 2;
    }

    // Add up. The fault: a ray counts by the factor that it has itself helped to learn.
    const Target& factors = fault_ == Fault::rays_of_this_frame ? learnt : memory_;
    double sum = control ? expected : 0.0f;
    for (std::size_t j = 0; j < picks.size(); ++j) {
      const std::size_t state = candidates[picks[j]].state;
      const double value = total / (static_cast<double>(count) * factor(factors[state]));
      sum += value * ((free[j] ? 1.0 : 0.0) - (control ? memory_[state] : 0.0f));
    }
    (control ? with_control : without_control) += 1;
    memory_ = learnt;
    return sum;
  }

  Rng rng_;
  Fault fault_;
  std::uint32_t count_ = 0;
  Target memory_{};
  float variance_ = 0;
};

using Light = std::function<Target(int)>;  ///< of a frame, 0-based

/// |z| of Lns and of the image at a frame, and the smallest relative bias of the image that
/// |z| = 4.5 shows.
struct Verdict {
  double lns = 0, image = 0, resolution = 0;
};

struct Moments {
  double sum = 0, squares = 0;
  void add(double x) {
    sum += x;
    squares += x * x;
  }
  double z(double expected, int n) const {
    const double mean = sum / n;
    return std::fabs(mean - expected) / std::max(error(n), 1e-12);
  }
  double error(int n) const { return std::sqrt((squares / n - sum / n * sum / n) / (n - 1)); }
};

Verdict run(const Light& light, int frame, int chains, Fault fault = Fault::none) {
  const Target last = light(frame - 1);
  double lns = 0, image = 0;
  for (std::size_t i = 0; i < kStates; ++i) {
    lns += last[i];
    image += last[i] * kVisible[i];
  }
  Moments lns_moments, image_moments;
  for (int c = 0; c < chains; ++c) {
    Chain chain(static_cast<std::uint64_t>(c) + 1, fault);
    FrameEstimate e;
    for (int f = 0; f < frame; ++f) e = chain.step(light(f));
    lns_moments.add(e.lns);
    image_moments.add(e.image);
  }
  return {lns_moments.z(lns, chains), image_moments.z(image, chains),
          image > 0 ? 4.5 * image_moments.error(chains) / image : 0};
}

const Light kTurning = [](int f) { return lobe(static_cast<std::size_t>(f / 3) % kStates, 0.2f); };

/// Light in half shadow, where a memory never settles.
const Light kPenumbra = [](int) {
  Target t;
  t.fill(0.05f);
  t[7] = 2;
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
    {"cuts", [](int f) { return f % 5 == 4 ? lobe(8, 0.0f) : lobe(1, 0.3f); }},
    {"black to lit", [](int f) { return f % 4 < 2 ? Target{} : lobe(6, 0.1f); }},
    {"growing support", [](int f) {
       Target t{};
       for (std::size_t i = 0; i < kStates; ++i) t[i] = static_cast<int>(i) <= f % 12 ? 1.0f : 0.0f;
       return t;
     }}};

// Hypothesis: E[Lns^] = Lns and E[image] = image at frames 1, 5, 20 and 100 of six lights. 48
// z-tests at level 1e-3 with Sidak: |z| < 4.3, here 4.5; 15000 to 580 chains resolve a bias of 2 to
// 17 % of the image.
TEST(Pool, IsUnbiasedAtEveryFrame) {
  for (const Case& c : kCases) {
    for (const int frame : {1, 5, 20, 100}) {
      const Verdict v = run(c.light, frame, 60000 / (frame + 3));
      EXPECT_LT(v.lns, 4.5) << c.name << " frame " << frame;
      EXPECT_LT(v.image, 4.5) << c.name << " frame " << frame;
      EXPECT_LT(v.resolution, 0.17) << c.name << " frame " << frame;
    }
  }
}

TEST(Pool, ShadesEitherWayWithFewAndMany) {
  Chain chain(1, Fault::none);
  for (int f = 0; f < 100; ++f) chain.step(lobe(f < 50 ? 0 : 4, 0.2f));
  EXPECT_GT(chain.with_control, 20);
  EXPECT_GT(chain.without_control, 5);
  EXPECT_LT(chain.fewest_rays, static_cast<std::size_t>(kRays));
  EXPECT_GT(chain.most_rays, static_cast<std::size_t>(kRays));
  EXPECT_LT(chain.fewest_candidates, kCandidates);
  EXPECT_GT(chain.most_candidates, kCandidates);
}

TEST(Pool, RaysGoWhereDoubtIs) {
  EXPECT_EQ(rays_for_doubt(16, 0.025f, 1), 16);
  EXPECT_EQ(rays_for_doubt(16, 0.001f, 1), 8);
  EXPECT_EQ(rays_for_doubt(16, 3, 60), 27);
  EXPECT_EQ(rays_for_doubt(16, 30, 60), 64);
  EXPECT_EQ(rays_for_doubt(64, 0.5f, 1), 64);
  EXPECT_EQ(rays_for_doubt(1, 0.0f, 1), 1);
}

// The same machinery must see each way to spoil it.
TEST(Pool, VisibilityOfThisFramesRaysIsSeen) {
  EXPECT_GT(run(kPenumbra, 10, 6000, Fault::rays_of_this_frame).image, 4.5);
}
TEST(Pool, CandidatesByTheirOwnNoiseAreSeen) {
  EXPECT_GT(run(kPenumbra, 10, 6000, Fault::candidates_by_noise_of_this_frame).lns, 4.5);
}
TEST(Pool, RaysAddedByOutcomeAreSeen) {
  EXPECT_GT(run(kPenumbra, 10, 12000, Fault::more_rays_after_a_blocked_one).image, 4.5);
}

}  // namespace
}  // namespace baton
