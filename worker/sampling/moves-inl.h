// The moves of the sequential sampler: Metropolis-Hastings kernels on the particles of one pixel.
// Included once per Highway target.
#if defined(BATON_WORKER_SAMPLING_MOVES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SAMPLING_MOVES_INL_H_
#undef BATON_WORKER_SAMPLING_MOVES_INL_H_
#else
#define BATON_WORKER_SAMPLING_MOVES_INL_H_
#endif

#include <hwy/highway.h>

#include "common/base/limits.h"
#include "common/math/lanes-inl.h"
#include "common/math/philox-inl.h"
#include "worker/sampling/sequential.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What the sampler asks of a point (site, direction): the logs of the unnormalised targets of the
/// frame before and of this frame, and of the density of independent proposals. kLogZero stands for
/// log 0.
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
  HWY_ALIGN float
      log_increment[kCapacity];  ///< sum over k of log p^k / p^(k-1) at the particle's positions
};

/// Uniform in the cap of cosine `cap_cosine` around w: symmetric, so it cancels in the acceptance
/// ratio.
HWY_INLINE Vec3Lanes PerturbDirection(const Vec3Lanes& w, float cap_cosine, VF u0, VF u1) {
  const DF d;
  VF sine, cosine;
  SinCosTurns(u1, sine, cosine);
  const VF drop = hn::Mul(u0, hn::Set(d, 1 - cap_cosine));  // 1 - z without cancellation
  const VF r = hn::Sqrt(hn::Max(hn::Mul(drop, hn::Sub(hn::Set(d, 2.0f), drop)), hn::Zero(d)));
  return FrameToWorld(w, {hn::Mul(r, cosine), hn::Mul(r, sine), hn::Sub(hn::Set(d, 1.0f), drop)});
}

/// Independent proposals come in blocks of so many neighbours of the target's supply: each
/// particle's proposal has the right density, and those of a block are well spread among
/// themselves. The weights need no more: E[sum W_j h(w_j)] depends only on each particle's own
/// kernel.
inline constexpr std::size_t kProposalBlock = 8;

/// One Metropolis-Hastings move of every particle that leaves p^(tempering_beta) invariant [eq. 7,
/// 8 and the general ratio] and counts it in `outcome`. All particles of the pixel make the same
/// kind of move, chosen independently of their positions.
template <class Target>
HWY_INLINE void MoveParticles(const Target& target, const SequentialSettings& settings,
                              float tempering_beta, const Rng& rng, std::uint32_t step,
                              ParticleArrays& p, SequentialOutcome& outcome) {
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
      next.code = EncodeOctahedral(
          PerturbDirection(DecodeOctahedral(code), settings.local_move_cosine,
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
    const MF possible = hn::Gt(hn::MulAdd(rest, next_log.before, hn::Mul(beta, next_log.now)),
                               hn::Set(d, kLogAlive));
    const MF inside =
        hn::Lt(hn::Iota(d, static_cast<float>(i)), hn::Set(d, static_cast<float>(count)));
    const MF accept = hn::And(hn::And(possible, inside), hn::Ge(log_ratio, LogLanes(u)));
    accepted += static_cast<std::int32_t>(hn::CountTrue(d, accept));

    hn::Store(hn::IfThenElse(hn::RebindMask(du, accept), next.code, code), du, p.code + i);
    hn::Store(hn::IfThenElse(hn::RebindMask(di, accept), next.site, site), di, p.site + i);
    hn::Store(hn::IfThenElse(accept, next_log.before, before), d, p.log_before + i);
    hn::Store(hn::IfThenElse(accept, next_log.now, now), d, p.log_now + i);
    hn::Store(hn::IfThenElse(accept, next_log.proposal, proposal), d, p.log_proposal + i);
  }
  MoveCounts& counts = local ? outcome.local : outcome.independent;
  counts.proposed += settings.num_particles;
  counts.accepted += accepted;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
