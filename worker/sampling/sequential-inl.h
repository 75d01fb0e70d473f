// One frame of the sequential Monte Carlo sampler [Ghosh, Doucet & Heidrich 2006, algorithms 1 and 2] for one pixel.
// Knows no scene: everything about targets and proposals comes from the Target. Included once per Highway target.
#if defined(BATON_WORKER_SAMPLING_SEQUENTIAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SAMPLING_SEQUENTIAL_INL_H_
#undef BATON_WORKER_SAMPLING_SEQUENTIAL_INL_H_
#else
#define BATON_WORKER_SAMPLING_SEQUENTIAL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "common/base/limits.h"
#include "common/math/lanes-inl.h"
#include "common/math/philox-inl.h"
#include "worker/sampling/ess.h"
#include "worker/sampling/resampling.h"
#include "worker/sampling/sequential.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What the sampler asks of a point (site, direction): the logs of the unnormalised targets of the frame before and of
/// this frame, and of the density of independent proposals. kLogZero stands for log 0.
struct LogTargets {
  VF before, now, proposal;
};

/// A point of the sampled space per lane.
struct PointLanes {
  VU code;  ///< OctDirection
  VI site;
};

/// The particles of one pixel with everything the step needs, padded to whole vectors.
struct ParticleArrays {
  static constexpr std::size_t kCapacity = limits::kMaxParticles;
  HWY_ALIGN std::uint32_t code[kCapacity];
  HWY_ALIGN std::int32_t site[kCapacity];
  HWY_ALIGN float log_before[kCapacity];
  HWY_ALIGN float log_now[kCapacity];
  HWY_ALIGN float log_proposal[kCapacity];
  HWY_ALIGN float log_increment[kCapacity];  ///< sum over k of log p^k / p^(k-1) at the particle's positions
};

/// Uniform in the cap of cosine `cap_cosine` around w: symmetric, so it cancels in the acceptance ratio.
HWY_INLINE Vec3Lanes PerturbDirection(const Vec3Lanes& w, float cap_cosine, VF u0, VF u1) {
  const DF d;
  VF sine, cosine;
  SinCosTurns(u1, sine, cosine);
  const VF drop = hn::Mul(u0, hn::Set(d, 1 - cap_cosine));  // 1 - z without cancellation
  const VF r = hn::Sqrt(hn::Max(hn::Mul(drop, hn::Sub(hn::Set(d, 2.0f), drop)), hn::Zero(d)));
  return FrameToWorld(w, {hn::Mul(r, cosine), hn::Mul(r, sine), hn::Sub(hn::Set(d, 1.0f), drop)});
}

/// Independent proposals come in blocks of so many neighbours of the target's supply: each particle's proposal has the
/// right density, and those of a block are well spread among themselves. The weights need no more: E[sum W_j h(w_j)]
/// depends only on each particle's own kernel.
inline constexpr std::size_t kProposalBlock = 8;

/// One Metropolis-Hastings move of every particle that leaves p^(tempering_beta) invariant [eq. 7, 8 and the general
/// ratio]. All particles of the pixel make the same kind of move, chosen independently of their positions.
template <class Target>
HWY_INLINE std::int32_t MoveParticles(const Target& target, const SequentialSettings& settings, float tempering_beta,
                                      const Rng& rng, std::uint32_t step, ParticleArrays& p) {
  const DF d;
  const DI di;
  const DU du;
  const auto count = static_cast<std::size_t>(settings.num_particles);
  const bool local = uniform_float(rng.bits(step, 0xFFFFFFFFu)[0]) < settings.local_move_fraction;
  const VF beta = hn::Set(d, tempering_beta);
  const VF rest = hn::Set(d, 1 - tempering_beta);

  std::int32_t accepted = 0;
  std::size_t block_start = 0;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const auto random = PhiloxBlock(du, rng, step, hn::Iota(du, static_cast<std::uint32_t>(i)));
    if (i % kProposalBlock == 0) block_start = target.BlockStart(hn::GetLane(random.w0));
    const VU code = hn::Load(du, p.code + i);
    const VI site = hn::Load(di, p.site + i);
    const VF before = hn::Load(d, p.log_before + i);
    const VF now = hn::Load(d, p.log_now + i);
    const VF proposal = hn::Load(d, p.log_proposal + i);

    // Propose.
    PointLanes next{code, site};
    LogTargets next_log;
    if (local) {
      next.code = EncodeOctahedral(PerturbDirection(DecodeOctahedral(code), settings.local_move_cosine,
                                                    UniformLanes(d, random.w0), UniformLanes(d, random.w1)));
      next_log = target.Evaluate(next);
    } else {
      next_log = target.Propose(block_start + i % kProposalBlock, UniformLanes(d, random.w1), next);
    }

    // Accept with min(1, p(next) q(current) / (p(current) q(next))); q cancels in symmetric moves.
    VF log_ratio = hn::Sub(hn::MulAdd(rest, next_log.before, hn::Mul(beta, next_log.now)),
                           hn::MulAdd(rest, before, hn::Mul(beta, now)));
    if (!local) log_ratio = hn::Add(log_ratio, hn::Sub(proposal, next_log.proposal));
    const VF u = hn::Max(UniformLanes(d, random.w2), hn::Set(d, 0x1p-25f));
    const MF possible = hn::Gt(hn::MulAdd(rest, next_log.before, hn::Mul(beta, next_log.now)), hn::Set(d, kLogAlive));
    const MF inside = hn::Lt(hn::Iota(d, static_cast<float>(i)), hn::Set(d, static_cast<float>(count)));
    const MF accept = hn::And(hn::And(possible, inside), hn::Ge(log_ratio, LogLanes(u)));
    accepted += static_cast<std::int32_t>(hn::CountTrue(d, accept));

    hn::Store(hn::IfThenElse(hn::RebindMask(du, accept), next.code, code), du, p.code + i);
    hn::Store(hn::IfThenElse(hn::RebindMask(di, accept), next.site, site), di, p.site + i);
    hn::Store(hn::IfThenElse(accept, next_log.before, before), d, p.log_before + i);
    hn::Store(hn::IfThenElse(accept, next_log.now, now), d, p.log_now + i);
    hn::Store(hn::IfThenElse(accept, next_log.proposal, proposal), d, p.log_proposal + i);
  }
  return accepted;
}

/// Adds log p^k / p^(k-1) = (log p_n - log p_(n-1)) / P at the current positions [eq. 12].
HWY_INLINE void AddIncrement(float inverse_distributions, std::size_t count, ParticleArrays& p) {
  const DF d;
  const VF share = hn::Set(d, inverse_distributions);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VF ratio = hn::Sub(hn::Load(d, p.log_now + i), hn::Load(d, p.log_before + i));
    hn::Store(hn::MulAdd(share, ratio, hn::Load(d, p.log_increment + i)), d, p.log_increment + i);
  }
}

/// Multiplies the weights by exp(log_increment), updates Lns [eq. 10] and normalises [eq. 4].
HWY_INLINE void Reweight(std::size_t count, float lns_before, const ParticleArrays& p, float* weight,
                         SequentialOutcome& outcome) {
  const DF d;
  // The largest increment of a living particle is factored out so that no exp overflows.
  float largest = kLogZero;
  for (std::size_t i = 0; i < count; ++i) {
    if (weight[i] > 0) largest = std::max(largest, p.log_increment[i]);
  }
  HWY_ALIGN float gain[ParticleArrays::kCapacity];
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VF shifted = hn::Sub(hn::Load(d, p.log_increment + i), hn::Set(d, largest));
    hn::Store(ExpLanes(shifted), d, gain + i);
  }
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    // exp(-87) stands in for everything smaller: a weight that small is zero.
    weight[i] = p.log_increment[i] - largest <= -87.0f ? 0.0f : weight[i] * gain[i];
    sum += weight[i];
  }
  outcome.lns = static_cast<float>(lns_before * std::exp(static_cast<double>(largest)) * sum);
  outcome.alive = largest > kLogAlive && sum > 0 && outcome.lns > 0 && std::isfinite(outcome.lns);
  if (!outcome.alive) return;
  const auto inverse = static_cast<float>(1 / sum);
  for (std::size_t i = 0; i < count; ++i) weight[i] *= inverse;
  outcome.ess = effective_sample_size({weight, count});
}

/// Resamples when the effective sample size is below the threshold; all weights become 1/N.
HWY_INLINE void ResampleIfNeeded(const SequentialSettings& settings, const Rng& rng, ParticleArrays& p, float* weight,
                                 SequentialOutcome& outcome) {
  const auto count = static_cast<std::size_t>(settings.num_particles);
  if (!(outcome.ess < settings.ess_ratio_min * static_cast<float>(count))) return;
  std::int32_t ancestors[ParticleArrays::kCapacity];
  resample(settings.resampling, {weight, count}, {ancestors, count}, rng, 0);
  const ParticleArrays old = p;
  for (std::size_t m = 0; m < count; ++m) {
    const auto a = static_cast<std::size_t>(ancestors[m]);
    p.code[m] = old.code[a];
    p.site[m] = old.site[a];
    p.log_before[m] = old.log_before[a];
    p.log_now[m] = old.log_now[a];
    p.log_proposal[m] = old.log_proposal[a];
    weight[m] = 1.0f / static_cast<float>(count);
  }
  outcome.resampled = true;
}

/// Carries the particles of one pixel from the target of the frame before to this frame's.
/// lns_before: estimate of the previous normalising constant, > 0. move_rng and resample_rng: addressed by pixel and frame.
/// P = 1 weights, resamples, then moves [algorithm 1]; P > 1 weights and moves P times, then resamples [algorithm 2].
/// When the outcome is not alive the particles are not usable.
template <class Target>
HWY_INLINE SequentialOutcome SequentialStep(const Target& target, const SequentialSettings& settings, float lns_before,
                                            const Rng& move_rng, const Rng& resample_rng, ParticleSpan particles) {
  const DF d;
  const DI di;
  const DU du;
  const auto count = static_cast<std::size_t>(settings.num_particles);
  const int distributions = settings.num_distributions;
  SequentialOutcome outcome;

  // Evaluate both targets at the old positions.
  ParticleArrays p;
  const std::size_t padded = hwy::RoundUpTo(count, hn::Lanes(d));
  for (std::size_t i = 0; i < padded; ++i) {
    const std::size_t j = std::min(i, count - 1);
    p.code[i] = particles.direction[j];
    p.site[i] = particles.site[j];
    p.log_increment[i] = 0;
  }
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const LogTargets log = target.Evaluate({hn::Load(du, p.code + i), hn::Load(di, p.site + i)});
    hn::Store(log.before, d, p.log_before + i);
    hn::Store(log.now, d, p.log_now + i);
    hn::Store(log.proposal, d, p.log_proposal + i);
  }

  // Walk through the intermediate distributions p^k = p_(n-1)^(1 - k/P) p_n^(k/P).
  for (int k = 1; k <= distributions; ++k) {
    AddIncrement(1.0f / static_cast<float>(distributions), count, p);
    if (distributions == 1) {
      Reweight(count, lns_before, p, particles.weight, outcome);
      if (!outcome.alive) return outcome;
      ResampleIfNeeded(settings, resample_rng, p, particles.weight, outcome);
    }
    const float tempering_beta = static_cast<float>(k) / static_cast<float>(distributions);
    outcome.moves_accepted +=
        MoveParticles(target, settings, tempering_beta, move_rng, static_cast<std::uint32_t>(k), p);
    outcome.moves_proposed += settings.num_particles;
  }
  if (distributions > 1) {
    Reweight(count, lns_before, p, particles.weight, outcome);
    if (!outcome.alive) return outcome;
    ResampleIfNeeded(settings, resample_rng, p, particles.weight, outcome);
  }

  for (std::size_t i = 0; i < count; ++i) {
    particles.direction[i] = p.code[i];
    particles.site[i] = static_cast<std::uint8_t>(p.site[i]);
  }
  return outcome;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
