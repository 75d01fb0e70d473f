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
#include "common/base/poison.h"
#include "common/math/lanes-inl.h"
#include "common/math/padded_array.h"
#include "common/math/philox-inl.h"
#include "worker/sampling/sequential.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// What the sampler asks of a point (site, direction).
struct TargetLanes {
  /// Log of the unnormalised target, of the frame before and of this one; kLogZero is log 0.
  VF log_before, log_now;
  VF density;          ///< density of independent proposals
  VF inverse_density;  ///< 0 where the density is
  /// (f cos L)_rgb of this frame; `log_now` is the log of its mean.
  Vec3Lanes reflected;
};

/// 1 / x, 0 where x is not positive.
HWY_INLINE VF InverseOrZero(VF x) {
  const DF d;
  const MF positive = hn::Gt(x, hn::Zero(d));
  return hn::IfThenElseZero(positive, hn::Div(hn::Set(d, 1.0f), x));
}

/// log x, kLogZero where x is (almost) 0.
HWY_INLINE VF LogOrZero(VF x) {
  const DF d;
  const MF positive = hn::Gt(x, hn::Set(d, 1e-37f));
  return hn::IfThenElse(positive, LogLanes(hn::Max(x, hn::Set(d, 1e-37f))), hn::Set(d, kLogZero));
}

/// A point of the sampled space per lane.
struct PointLanes {
  VU code;  ///< OctDirection
  VI site;
};

/// The particles of one pixel with everything the sampler needs, (N) each; the last vector is
/// filled up with particles without weight.
struct ParticleArrays {
  template <class T>
  using Column = PaddedArray<T, limits::kMaxParticles>;
  Column<std::uint32_t> code;
  Column<std::int32_t> site;
  Column<float> weight;  ///< sum 1
  Column<float> log_before, log_now;
  Column<float> inverse_density;
  Column<float> r, g, b;  ///< TargetLanes::reflected
  /// Sum over k of log p^k / p^(k-1) at the particle's positions.
  Column<float> log_increment;
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

/// The random numbers of a pixel's moves, addressed by the move's number and the particle. A block
/// of Philox has 128 bits and a uniform takes 24: the acceptances of five moves share one.
class MoveRandom {
 public:
  MoveRandom(const Rng& rng, std::size_t num_particles) : rng_(rng), count_(num_particles) {
    for (auto* words : {&kind_, &first_, &distance_, &site_}) poison(*words);
    poison(accept_);
  }

  /// What move `move` (0-based, ascending from call to call) needs beside its proposals.
  HWY_INLINE void Begin(std::uint32_t move) {
    if (move % kWindow == 0) {
      const DU du;
      for (std::size_t i = 0; i < kWindow; i += hn::Lanes(du)) {
        const VU index = CountFrom(du, kChoices + move + static_cast<std::uint32_t>(i));
        const auto bits = PhiloxBlock(du, rng_, 0, index);
        hn::Store(bits.w0, du, kind_ + i);
        hn::Store(bits.w1, du, first_ + i);
        hn::Store(bits.w2, du, distance_ + i);
        hn::Store(bits.w3, du, site_ + i);
      }
    }
    if (move % kShare != 0) return;
    const DU du;
    const VU byte = hn::Set(du, 0xFFu);
    for (std::size_t i = 0; i < count_; i += hn::Lanes(du)) {
      const auto bits = PhiloxBlock(du, rng_, move / kShare,
                                    CountFrom(du, kAcceptance + static_cast<std::uint32_t>(i)));
      hn::Store(bits.w0, du, accept_[0].from(i));
      hn::Store(bits.w1, du, accept_[1].from(i));
      hn::Store(bits.w2, du, accept_[2].from(i));
      hn::Store(bits.w3, du, accept_[3].from(i));
      // The fifth has the bits that the others leave over.
      const VU upper =
          hn::Or(hn::ShiftLeft<24>(bits.w0), hn::ShiftLeft<16>(hn::And(bits.w1, byte)));
      hn::Store(hn::Or(upper, hn::ShiftLeft<8>(hn::And(bits.w2, byte))), du, accept_[4].from(i));
    }
  }

  /// Decides the kind of the move.
  bool IsLocal(std::uint32_t move, float local_fraction) const {
    return uniform_float(kind_[move % kWindow]) < local_fraction;
  }
  /// Bits that choose the b-th block of proposals of the move: each uniform, any two independent.
  std::uint32_t BlockBits(std::uint32_t move, std::uint32_t b) const {
    return first_[move % kWindow] + b * (distance_[move % kWindow] | 1u);
  }
  /// Uniforms that place the independent proposals of particles i, i + 1, ...: multiples of the
  /// golden ratio from a random start, so that sites are shared out evenly.
  HWY_INLINE VF SiteFraction(std::uint32_t move, std::size_t i) const {
    const DU du;
    const VU number = CountFrom(du, static_cast<std::uint32_t>(i));
    const VU steps = hn::Mul(number, hn::Set(du, 0x9E3779B9u));
    return UniformLanes(DF(), hn::Add(hn::Set(du, site_[move % kWindow]), steps));
  }
  /// Uniforms that accept particles i, i + 1, ...
  HWY_INLINE VF Acceptance(std::uint32_t move, std::size_t i) const {
    return UniformLanes(DF(), hn::Load(DU(), accept_[move % kShare].from(i)));
  }
  /// Two words for the local proposals of particles i, i + 1, ...
  HWY_INLINE PhiloxLanes<VU> Proposal(std::uint32_t move, std::size_t i) const {
    return PhiloxBlock(DU(), rng_, move + 1, CountFrom(DU(), static_cast<std::uint32_t>(i)));
  }
  /// How many moves Begin draws ahead.
  static constexpr std::uint32_t kWindow = 8;

 private:
  /// Moves whose acceptances share a block.
  static constexpr std::uint32_t kShare = 5;
  /// Indices past those of particles.
  static constexpr std::uint32_t kChoices = 0x80000000u, kAcceptance = 0x40000000u;

  const Rng& rng_;
  std::size_t count_;
  HWY_ALIGN std::uint32_t kind_[kWindow];
  HWY_ALIGN std::uint32_t first_[kWindow];
  HWY_ALIGN std::uint32_t distance_[kWindow];
  HWY_ALIGN std::uint32_t site_[kWindow];
  ParticleArrays::Column<std::uint32_t> accept_[kShare];
};

/// Fetches the proposals of the moves that `random` has drawn ahead into the cache.
template <class Target>
HWY_INLINE void PrefetchProposals(const Target& target, const SequentialSettings& settings,
                                  const MoveRandom& random, std::uint32_t first,
                                  std::uint32_t end) {
  const auto blocks = static_cast<std::uint32_t>(
      (static_cast<std::size_t>(settings.num_particles) + kProposalBlock - 1) / kProposalBlock);
  for (std::uint32_t move = first; move < end; ++move) {
    if (random.IsLocal(move, settings.local_move_fraction)) continue;
    for (std::uint32_t b = 0; b < blocks; ++b) target.Prefetch(random.BlockBits(move, b));
  }
}

/// One Metropolis-Hastings move of every particle that leaves p^(tempering_beta) invariant [eq. 7,
/// 8 and the general ratio] and counts it in `outcome`. All particles of the pixel make the same
/// kind of move, chosen independently of their positions. keep_before: log_before is still needed
/// at the new positions; else it is left undefined (tempering_beta must then be 1).
template <class Target>
HWY_INLINE void MoveParticles(const Target& target, const SequentialSettings& settings,
                              float tempering_beta, bool keep_before, const MoveRandom& random,
                              std::uint32_t move, ParticleArrays& p, SequentialOutcome& outcome) {
  const DF d;
  const DI di;
  const DU du;
  const auto count = static_cast<std::size_t>(settings.num_particles);
  const bool local = random.IsLocal(move, settings.local_move_fraction);
  const VF beta = hn::Set(d, tempering_beta);
  const VF rest = hn::Set(d, 1 - tempering_beta);

  std::int32_t accepted = 0;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VU code = hn::Load(du, p.code.from(i));
    const VI site = hn::Load(di, p.site.from(i));
    const VF before = hn::Load(d, p.log_before.from(i));
    const VF now = hn::Load(d, p.log_now.from(i));
    const VF inverse_density = hn::Load(d, p.inverse_density.from(i));

    // Propose.
    PointLanes next{code, site};
    TargetLanes at_next;
    if (local) {
      const auto bits = random.Proposal(move, i);
      next.code =
          EncodeOctahedral(PerturbDirection(DecodeOctahedral(code), settings.local_move_cosine,
                                            UniformLanes(d, bits.w0), UniformLanes(d, bits.w1)));
      target.Evaluate(next, keep_before, at_next);
    } else {
      const VF site_fraction = target.ManySites() ? random.SiteFraction(move, i) : hn::Zero(d);
      const std::size_t start =
          target.BlockStart(random.BlockBits(move, static_cast<std::uint32_t>(i / kProposalBlock)));
      target.Propose(start + i % kProposalBlock, site_fraction, keep_before, next, at_next);
    }

    // Accept when p(next) / p(current) >= u q(next) / q(current); q cancels in symmetric moves.
    VF log_next = hn::Mul(beta, at_next.log_now);
    VF log_current = hn::Mul(beta, now);
    if (keep_before) {
      log_next = hn::MulAdd(rest, at_next.log_before, log_next);
      log_current = hn::MulAdd(rest, before, log_current);
    }
    VF least = hn::Max(random.Acceptance(move, i), hn::Set(d, 0x1p-25f));
    if (!local) {
      least = hn::Mul(least, hn::Mul(at_next.density, inverse_density));
      least = hn::Clamp(least, hn::Set(d, 1e-37f), hn::Set(d, 1e37f));
    }
    const MF possible = hn::Gt(log_next, hn::Set(d, kLogAlive));
    const MF inside =
        hn::Lt(CountFrom(d, static_cast<float>(i)), hn::Set(d, static_cast<float>(count)));
    const MF accept =
        hn::And(hn::And(possible, inside), hn::Ge(hn::Sub(log_next, log_current), LogLanes(least)));
    accepted += static_cast<std::int32_t>(hn::CountTrue(d, accept));

    hn::Store(hn::IfThenElse(hn::RebindMask(du, accept), next.code, code), du, p.code.from(i));
    hn::Store(hn::IfThenElse(hn::RebindMask(di, accept), next.site, site), di, p.site.from(i));
    const auto move_to = [&](VF value, ParticleArrays::Column<float>& column) HWY_ATTR {
      hn::Store(hn::IfThenElse(accept, value, hn::Load(d, column.from(i))), d, column.from(i));
    };
    move_to(at_next.log_now, p.log_now);
    move_to(at_next.inverse_density, p.inverse_density);
    move_to(at_next.reflected.x, p.r);
    move_to(at_next.reflected.y, p.g);
    move_to(at_next.reflected.z, p.b);
    if (keep_before) move_to(at_next.log_before, p.log_before);
  }
  MoveCounts& counts = local ? outcome.local : outcome.independent;
  counts.proposed += settings.num_particles;
  counts.accepted += accepted;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
