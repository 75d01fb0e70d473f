#pragma once

// A small exact space for the sequential sampler: eight points with given targets. "Directions" are
// indices, proposals uniform. Compiled for the one instruction set of the test.
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "tests/support/moments.h"
#include "worker/sampling/sequential-inl.h"

namespace baton::HWY_NAMESPACE {

inline constexpr std::uint32_t kPoints = 8;
using PointValues = std::array<float, kPoints>;

inline PointValues log_of(const PointValues& target) {
  PointValues logs{};
  for (std::size_t i = 0; i < kPoints; ++i)
    logs[i] = target[i] > 0 ? std::log(target[i]) : kLogZero;
  return logs;
}

struct DiscreteTarget {
  PointValues before, now;
  PointValues log_before, log_now;

  DiscreteTarget(const PointValues& target_before, const PointValues& target_now)
      : before(target_before), now(target_now), log_before(log_of(before)), log_now(log_of(now)) {}

  void Evaluate(const PointLanes& point, bool /*want_before*/, TargetLanes& out) const {
    const DF d;
    const VI index = hn::BitCast(DI(), point.code);
    out.log_before = hn::GatherIndex(d, log_before.data(), index);
    out.log_now = hn::GatherIndex(d, log_now.data(), index);
    out.density = hn::Set(d, 1.0f / kPoints);
    out.inverse_density = hn::Set(d, kPoints);
    SetZero(out.reflected);
  }
  void EvaluateCarried(std::size_t /*i*/, const PointLanes& point, bool want_before,
                       TargetLanes& out) const {
    Evaluate(point, want_before, out);
  }
  static bool ManySites() { return false; }
  void Prefetch(std::uint32_t /*bits*/) const {}
  /// Blocks of neighbours from a random start on the ring of points.
  static std::size_t BlockStart(std::uint32_t bits) { return bits % kPoints; }
  void Propose(std::size_t entry, VF /*site_fraction*/, bool want_before, PointLanes& point,
               TargetLanes& out) const {
    point.code =
        hn::And(CountFrom(DU(), static_cast<std::uint32_t>(entry)), hn::Set(DU(), kPoints - 1));
    Evaluate(point, want_before, out);
  }
};

inline float sum_of(const PointValues& target) {
  return std::accumulate(target.begin(), target.end(), 0.0f);
}

/// Particles drawn independently from `before`, as SIR would leave them.
struct Particles {
  std::vector<OctDirection> code;
  std::vector<std::uint8_t> site;
  std::vector<float> weight;
  std::vector<float> unused;  ///< colours, which this space does not have

  Particles(const PointValues& before, std::size_t count, std::uint64_t seed)
      : code(count),
        site(count, 0),
        weight(count, 1.0f / static_cast<float>(count)),
        unused(count) {
    const Rng rng({.job_seed = seed}, PassId::choose);
    for (std::size_t i = 0; i < count; ++i) {
      float left = rng.uniforms(0, static_cast<std::uint32_t>(i))[0] * sum_of(before);
      std::uint32_t point = 0;
      while (point + 1 < kPoints && left >= before[point]) left -= before[point++];
      code[i] = point;
    }
  }
  ParticleSpan span() {
    return {code.data(), site.data(), weight.data(), unused.data(), unused.data(), unused.data()};
  }
};

inline SequentialOutcome step(const DiscreteTarget& target, const SequentialSettings& settings,
                              std::uint64_t seed, Particles& p, float lns_before,
                              std::uint32_t frame = 0) {
  const RngKey key{.job_seed = seed, .frame = frame};
  return SequentialStep(target, settings, lns_before, Rng(key, PassId::move),
                        Rng(key, PassId::resample), p.span());
}

using test::Moments;

}  // namespace baton::HWY_NAMESPACE
