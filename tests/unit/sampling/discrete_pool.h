#pragma once

// A small exact space for the step of the pool sampler: twelve directions, each in a bin of its
// own, free with a known probability. Compiled for the one instruction set of the test.
#include <array>
#include <functional>
#include <vector>

#include "common/math/octahedral.h"
#include "common/math/philox.h"
#include "worker/sampling/pool-inl.h"
#include "worker/sampling/visibility_table.h"

namespace baton::HWY_NAMESPACE {

inline constexpr std::size_t kStates = 12;
inline constexpr std::int32_t kRays = 5, kCandidates = 32, kMostCandidates = 128;
using StateValues = std::array<float, kStates>;

/// Probability that a ray is free.
inline constexpr StateValues kVisible{1, 1, 1, 0.5f, 0, 0, 1, 0.2f, 0, 1, 1, 0.9f};

/// Directions of different bins.
inline OctDirection code_of(std::size_t state) {
  const auto bin = static_cast<std::uint32_t>(20 * state + 2);
  return (bin & 15) << 12 | 0x800 | (bin >> 4) << 28 | 0x8000000;
}
inline std::size_t state_of_bin(std::size_t bin) { return bin / 20; }
inline std::size_t state_of(OctDirection code) {
  return state_of_bin((code >> 12 & 0x0F) | (code >> 24 & 0xF0));
}

/// Candidates drawn alike from all states. Rays know nothing of them but their number on the line.
struct DiscreteCandidates {
  std::int32_t from_light = 0, from_bsdf = 0;
  float mean_radiance = 0;
  PaddedArray<OctDirection, kMostCandidates> code;
  PaddedArray<float, kMostCandidates> weight;
  /// Planted fault: each ray is traced when it is chosen, and what it finds changes what was
  /// expected of it, here.
  float* spoil = nullptr;
  std::function<bool(std::size_t state)> is_free{};
  mutable std::vector<bool> found{};  ///< by ray, where spoil is set

  template <class Line>
  void Weigh(Line& line) const {
    const DF d;
    for (std::size_t i = 0; i < static_cast<std::size_t>(from_light); i += hn::Lanes(d)) {
      const VF w = hn::Load(d, weight.from(i));
      line.Add(hn::Load(DU(), code.from(i)), hn::Set(d, 4 * kPi), w, [&](VF share, Vec3Lanes& sum) {
        const VF grey = hn::Mul(share, w);
        sum = Add(sum, {grey, grey, grey});
      });
    }
    line.BeginBsdf();
  }
  struct Lanes {
    VU code;
    VI site;
    Vec3Lanes reflected;
  };
  const DiscreteCandidates& Chosen() const { return *this; }
  Lanes Evaluate(VI pick) const {
    if (spoil != nullptr) trace_early(pick);
    const VF one = hn::Set(DF(), 1.0f);
    const auto* codes = reinterpret_cast<const std::int32_t*>(code.from(0));
    return {hn::BitCast(DU(), hn::GatherIndex(DI(), codes, pick)), hn::Zero(DI()), {one, one, one}};
  }

 private:
  void trace_early(VI pick) const {
    std::int32_t lane[hn::MaxLanes(DI())];
    hn::StoreU(pick, DI(), lane);
    for (const std::int32_t p : lane) {
      const OctDirection of = code[static_cast<std::size_t>(p)];
      found.push_back(is_free(state_of(of)));
      float& expected = spoil[(of >> 12 & 0x0F) | (of >> 24 & 0xF0)];
      expected += ((found.back() ? 1.0f : 0.0f) - expected) / 6;
    }
  }
};

/// What goes wrong on purpose.
enum class Fault {
  none,
  rays_of_this_frame,
  more_rays_after_a_blocked_one,
  candidates_by_noise_of_this_frame,
  /// No bias: the block has learnt from a neighbour that reads the same candidates, and to whom the
  /// same states are free in this frame. The order of pixels would show, that is all.
  rays_of_a_neighbour
};

struct FrameEstimate {
  double lns = 0, image = 0;
};

/// Work space of chains, one after the other.
struct PoolSpace {
  PoolLines lines;
  PixelRays rays;
  DiscreteCandidates candidates;
};

/// One pixel through the frames.
class PoolChain {
 public:
  PoolChain(std::uint64_t seed, PoolSpace& space, Fault fault = Fault::none)
      : rng_({.job_seed = seed}, PassId::move), space_(space), fault_(fault) {
    space.candidates.spoil = nullptr;
    space.candidates.found.clear();
  }

  int with_control = 0, without_control = 0;                       ///< frames shaded either way
  std::size_t fewest_rays = limits::kMaxParticles, most_rays = 0;  ///< of a frame
  std::int32_t fewest_candidates = kMostCandidates, most_candidates = 0;

  FrameEstimate step(const StateValues& now) {
    // Draw candidates. The fault: their number is decided by what the first of them show.
    float known = light_variance(own_).from_light;
    if (fault_ == Fault::candidates_by_noise_of_this_frame) {
      const std::uint32_t begin = count_;
      draw(now, kCandidates);
      choose(0.5f);
      known = space_.rays.light_variance.from_light;
      count_ = begin;
    }
    const std::int32_t count =
        candidates_for_noise(kTuning, kTuning.light, kCandidates, known, kMostCandidates);
    draw(now, count);
    fewest_candidates = std::min(fewest_candidates, count);
    most_candidates = std::max(most_candidates, count);

    // Choose rays and trace them.
    Memory learnt{memory_, own_};
    table_.read(memory_, kTuning.prior_rays);
    if (fault_ == Fault::rays_of_a_neighbour) {
      for (std::size_t i = 0; i < kStates; ++i) free_now_[i] = uniform() < kVisible[i];
      choose(uniform());
      bool unused = false;
      Memory of_neighbour = learnt;
      if (space_.rays.count > 0) trace(of_neighbour, unused);
      learnt.block = of_neighbour.block;
      table_.read(learnt.block, kTuning.prior_rays);
    }
    FrameEstimate e{.lns = choose(uniform())};
    if (space_.rays.count == 0) return e;
    const LightVariance seen = space_.rays.light_variance;
    bool first_is_free = false;
    e.image = trace(learnt, first_is_free);
    // The fault: where the first ray is blocked, as many again are traced.
    if (fault_ == Fault::more_rays_after_a_blocked_one && !first_is_free) {
      choose(uniform());
      e.image = (e.image + trace(learnt, first_is_free)) / 2;
    }
    memory_ = learnt.block;
    own_ = learnt.own;
    remember_light_variance(kTuning, seen, own_);
    return e;
  }

 private:
  struct Memory {
    BlockMemory block;
    PixelMemory own;
  };
  /// Rays and candidates get fewer and more in this space.
  static constexpr PoolTuning kTuning{
      .surroundings = 3, .control_from = 2, .usual_deviation = 0.05f, .light = {0.03f, 0.75f}};

  float uniform() { return rng_.uniforms(0, count_++)[0]; }

  void draw(const StateValues& now, std::int32_t count) {
    DiscreteCandidates& candidates = space_.candidates;
    candidates.from_light = count;
    candidates.mean_radiance = 12;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const auto state = static_cast<std::size_t>(uniform() * kStates);
      candidates.code[i] = code_of(state);
      candidates.weight[i] = now[state] * kStates / static_cast<float>(count);
    }
  }
  bool is_free(std::size_t state) {
    return fault_ == Fault::rays_of_a_neighbour ? free_now_[state] : uniform() < kVisible[state];
  }

  /// Chooses rays by what the frames before left; returns Lns.
  double choose(float u) {
    DiscreteCandidates& candidates = space_.candidates;
    if (fault_ == Fault::rays_of_this_frame) {
      candidates.spoil = table_.expected.data();
      candidates.is_free = [this](std::size_t state) { return is_free(state); };
      candidates.found.clear();
    }
    space_.rays.clear();
    return double{PoolStep(kTuning, candidates, u, kRays,
                           PixelVisibility(table_, own_, kTuning.own_prior_rays), space_.lines,
                           space_.rays)};
  }
  /// Traces the chosen rays and learns from them; returns the pixel.
  double trace(Memory& learnt, bool& first_is_free) {
    const PixelRays& rays = space_.rays;
    (rays.constant.visibility != 0 ? with_control : without_control) += 1;
    fewest_rays = std::min(fewest_rays, rays.count);
    most_rays = std::max(most_rays, rays.count);
    double sum = rays.constant.color.x;
    std::uint64_t free = 0;
    for (std::size_t j = 0; j < rays.count; ++j) {
      const std::vector<bool>& found = space_.candidates.found;
      const bool outcome =
          found.empty() ? is_free(state_of_bin(RayTag{rays.tag[j]}.bin())) : found[j];
      if (outcome) free |= std::uint64_t{1} << j;
      if (outcome) sum += rays.r[j];
    }
    remember_rays(rays.tag.first(rays.count), free, learnt.block, learnt.own);
    first_is_free = (free & 1) != 0;
    return sum;
  }

  Rng rng_;
  PoolSpace& space_;
  Fault fault_;
  std::uint32_t count_ = 0;
  BlockMemory memory_;
  PixelMemory own_;
  VisibilityTable table_;
  std::array<bool, kStates> free_now_{};  ///< with rays_of_a_neighbour
};

}  // namespace baton::HWY_NAMESPACE
