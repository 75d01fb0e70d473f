// ReSTIR's weights on a discrete space where everything is known. Chains are independent, so plain
// z-tests apply; level 1e-4 two-sided for each, |z| < 3.9. Seeds 1, 2, ...
#include "worker/sampling/restir.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

#include "common/math/philox.h"

namespace baton {
namespace {

constexpr std::size_t kStates = 8, kSamples = 4;
constexpr double kLimit = 3.9;
using Target = std::array<float, kStates>;

/// A properly weighted set: states and contributions.
struct Set {
  std::array<std::size_t, kSamples> state{};
  std::array<float, kSamples> contribution{};
  float confidence = 0;
  Target target{};
};

/// What goes wrong on purpose.
enum class Fault { none, estimate_in_the_weight, one_target_left_out };

/// One pixel through the frames, and a second one beside it with a target of its own, whose set of
/// the frame before is asked as a neighbour's.
class Chain {
 public:
  Chain(std::uint64_t seed, std::int32_t limit, Fault fault)
      : rng_({.job_seed = seed}, PassId::move), limit_(limit), fault_(fault) {}

  /// Sets of the pixel and of its neighbour in the next frame.
  void step(const Target& now, const Target& neighbor_now) {
    const Set pixel = combine(now, {pixel_, neighbor_});
    neighbor_ = combine(neighbor_now, {neighbor_});
    pixel_ = pixel;
  }
  const Set& pixel() const { return pixel_; }

 private:
  float uniform() { return rng_.uniforms(0, count_++)[0]; }

  Set draw(const Target& now) {
    Set set{.confidence = 1, .target = now};
    for (std::size_t j = 0; j < kSamples; ++j) {
      set.state[j] = static_cast<std::size_t>(uniform() * kStates);
      set.contribution[j] = now[set.state[j]] * kStates / kSamples;
    }
    return set;
  }

  Set combine(const Target& now, std::vector<Set> carried) {
    carried.insert(carried.begin(), draw(now));
    std::vector<std::size_t> state;
    std::vector<float> contribution, target_now;
    for (const Set& set : carried) {
      for (std::size_t j = 0; j < kSamples; ++j) {
        state.push_back(set.state[j]);
        contribution.push_back(set.contribution[j]);
        target_now.push_back(now[set.state[j]]);
      }
    }
    std::vector<std::vector<float>> before(carried.size());
    std::vector<RestirSet> sets;
    for (std::size_t t = 0; t < carried.size(); ++t) {
      for (const std::size_t s : state) before[t].push_back(carried[t].target[s]);
      sets.push_back({(t + 1) * kSamples,
                      std::min(carried[t].confidence, static_cast<float>(limit_)),
                      t == 0 ? nullptr : before[t].data()});
    }
    if (fault_ == Fault::estimate_in_the_weight) weigh_by_estimates(carried, sets);
    if (fault_ == Fault::one_target_left_out && sets.size() > 2)
      std::fill(before[2].begin(), before[2].end(), 0.0f);

    std::vector<float> weight(state.size());
    const double total = weigh_restir_sets(sets, contribution, target_now, weight);
    Set result{.confidence = static_cast<float>(next_confidence(sets, limit_)), .target = now};
    const float u = uniform();
    if (!(total > 0)) return result;
    std::array<std::uint32_t, kSamples> picks{};
    pick_systematically(weight, total, u, picks);
    for (std::size_t j = 0; j < kSamples; ++j) {
      result.state[j] = state[picks[j]];
      result.contribution[j] = static_cast<float>(total) / kSamples;
    }
    return result;
  }

  /// The fault: a set that found more light counts for more.
  static void weigh_by_estimates(const std::vector<Set>& carried, std::vector<RestirSet>& sets) {
    for (std::size_t t = 1; t < sets.size(); ++t) {
      sets[t].confidence *=
          std::accumulate(carried[t].contribution.begin(), carried[t].contribution.end(), 0.0f);
    }
  }

  Rng rng_;
  std::uint32_t count_ = 0;
  std::int32_t limit_;
  Fault fault_;
  Set pixel_, neighbor_;
};

Target lobe(std::size_t centre, std::size_t dark) {
  Target t{};
  for (std::size_t i = 0; i < kStates; ++i) {
    t[i] = (i + kStates - centre) % kStates < 3 ? 2.0f : 0.25f;
    if (i >= kStates - dark) t[i] = 0;
  }
  return t;
}

/// Frame by frame: lobes that turn, and supports that grow from two states to all.
Target pixel_target(int frame) {
  return lobe(static_cast<std::size_t>(frame),
              static_cast<std::size_t>(std::max(6 - 2 * frame, 0)));
}
Target neighbor_target(int frame) {
  return lobe(static_cast<std::size_t>(frame + 2),
              static_cast<std::size_t>(std::max(4 - frame, 0)));
}

/// The largest |z| of the expected contribution at any state after `frames`.
double worst_z(std::int32_t limit, int frames, Fault fault) {
  constexpr int kChains = 40000;
  std::array<double, kStates> sum{}, squares{};
  for (int chain = 1; chain <= kChains; ++chain) {
    Chain pixel(static_cast<std::uint64_t>(chain), limit, fault);
    for (int frame = 0; frame < frames; ++frame)
      pixel.step(pixel_target(frame), neighbor_target(frame));
    Target found{};
    for (std::size_t j = 0; j < kSamples; ++j)
      found[pixel.pixel().state[j]] += pixel.pixel().contribution[j];
    for (std::size_t i = 0; i < kStates; ++i) {
      sum[i] += found[i];
      squares[i] += double{found[i]} * found[i];
    }
  }
  const Target exact = pixel_target(frames - 1);
  double worst = 0;
  for (std::size_t i = 0; i < kStates; ++i) {
    const double mean = sum[i] / kChains;
    const double error = std::sqrt((squares[i] / kChains - mean * mean) / (kChains - 1));
    if (exact[i] == 0) {
      EXPECT_EQ(sum[i], 0);
    } else {
      worst = std::max(worst, std::fabs(mean - exact[i]) / error);
    }
  }
  return worst;
}

TEST(Restir, TheCombinedSetIsProperlyWeighted) {
  for (const std::int32_t limit : {1, 20}) {
    for (const int frames : {1, 2, 3, 6, 12}) {
      EXPECT_LT(worst_z(limit, frames, Fault::none), kLimit) << limit << " " << frames;
    }
  }
}

TEST(Restir, PlantedFaultsAreSeen) {
  EXPECT_GT(worst_z(20, 6, Fault::estimate_in_the_weight), 2 * kLimit);
  EXPECT_GT(worst_z(20, 6, Fault::one_target_left_out), 2 * kLimit);
}

TEST(Restir, PicksInProportionAndNeverWhatWeighsNothing) {
  const std::array<float, 6> weight{0, 1, 0, 3, 0, 0};
  std::array<std::uint32_t, 4> picks{};
  for (const float u : {0.0f, 0.5f, 0.99999994f}) {
    pick_systematically(weight, 4, u, picks);
    EXPECT_EQ(picks, (std::array<std::uint32_t, 4>{1, 3, 3, 3}));
  }
  // A total that is too large by rounding.
  pick_systematically(weight, 4.001, 0.99999994f, picks);
  EXPECT_EQ(picks.back(), 3u);
}

TEST(Restir, ConfidenceIsTheSumUpToTheLimit) {
  const std::array<RestirSet, 3> sets{
      RestirSet{.confidence = 1}, {.confidence = 7}, {.confidence = 20}};
  EXPECT_EQ(next_confidence(sets, 1000), 28);
  EXPECT_EQ(next_confidence(sets, 20), 20);
}

}  // namespace
}  // namespace baton
