// One frame of the sequential Monte Carlo sampler [Ghosh, Doucet & Heidrich 2006, algorithms 1 and
// 2] for one pixel. Free of any scene: all about targets and proposals comes from the Target.
// Included once per Highway target.
#if defined(BATON_WORKER_SAMPLING_SEQUENTIAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SAMPLING_SEQUENTIAL_INL_H_
#undef BATON_WORKER_SAMPLING_SEQUENTIAL_INL_H_
#else
#define BATON_WORKER_SAMPLING_SEQUENTIAL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "worker/sampling/moves-inl.h"
#include "worker/sampling/resampling.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Adds log p^k / p^(k-1) = (log p_n - log p_(n-1)) / P at the current positions [eq. 12].
HWY_INLINE void AddIncrement(float inverse_distributions, std::size_t count, ParticleArrays& p) {
  const DF d;
  const VF share = hn::Set(d, inverse_distributions);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VF ratio = hn::Sub(hn::Load(d, p.log_now.from(i)), hn::Load(d, p.log_before.from(i)));
    hn::Store(hn::MulAdd(share, ratio, hn::Load(d, p.log_increment.from(i))), d,
              p.log_increment.from(i));
  }
}

/// out_j = weight_j exp(log_increment_j), normalised; returns the log of the factor taken out, log
/// sum_j weight_j exp(...), or kLogZero when every weight is 0. out: may be p.weight.
HWY_INLINE double ApplyIncrements(std::size_t count, const ParticleArrays& p,
                                  ParticleArrays::Column<float>& out) {
  const DF d;
  // The largest increment of a living particle is factored out so that no exp overflows.
  VF most = hn::Set(d, kLogZero);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const MF lives = hn::Gt(hn::Load(d, p.weight.from(i)), hn::Zero(d));
    most = hn::Max(most, hn::IfThenElse(lives, hn::Load(d, p.log_increment.from(i)), most));
  }
  const VF largest = hn::MaxOfLanes(d, most);
  VF sums = hn::Zero(d);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VF shifted = hn::Sub(hn::Load(d, p.log_increment.from(i)), largest);
    // exp(-87) stands in for everything smaller: a weight that small is zero.
    const MF counts = hn::Gt(shifted, hn::Set(d, -87.0f));
    const VF weight =
        hn::IfThenElseZero(counts, hn::Mul(hn::Load(d, p.weight.from(i)), ExpLanes(shifted)));
    hn::Store(weight, d, out.from(i));
    sums = hn::Add(sums, weight);
  }
  const float sum = hn::GetLane(hn::SumOfLanes(d, sums));
  if (!(hn::GetLane(largest) > kLogAlive && sum > 0)) return kLogZero;
  const VF inverse = hn::Set(d, 1 / sum);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    hn::Store(hn::Mul(hn::Load(d, out.from(i)), inverse), d, out.from(i));
  }
  return double{hn::GetLane(largest)} + std::log(double{sum});
}

/// Effective sample size of the normalised weights [Kong et al. 1994]: (sum w)^2 / sum w^2.
HWY_INLINE float EffectiveSize(std::size_t count, const ParticleArrays::Column<float>& weight) {
  const DF d;
  VF sums = hn::Zero(d);
  VF squares = hn::Zero(d);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VF w = hn::Load(d, weight.from(i));
    sums = hn::Add(sums, w);
    squares = hn::MulAdd(w, w, squares);
  }
  const float sum = hn::GetLane(hn::SumOfLanes(d, sums));
  return sum * sum / hn::GetLane(hn::SumOfLanes(d, squares));
}

/// Mean of log p_n / p_(n-1) over the weighted particles, and the share of the weight that it is
/// taken over: particles outside the support that both frames have in common do not count.
struct PathMean {
  double mean = 0;
  double share = 0;
};
HWY_INLINE PathMean MeanLogRatio(std::size_t count, const ParticleArrays& p,
                                 const ParticleArrays::Column<float>& weight) {
  const DF d;
  VF sums = hn::Zero(d);
  VF shares = hn::Zero(d);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const VF before = hn::Load(d, p.log_before.from(i));
    const VF now = hn::Load(d, p.log_now.from(i));
    const MF common = hn::Gt(hn::Min(before, now), hn::Set(d, kLogAlive));
    const VF w = hn::IfThenElseZero(common, hn::Load(d, weight.from(i)));
    shares = hn::Add(shares, w);
    sums = hn::MulAdd(w, hn::Sub(now, before), sums);
  }
  const double share = hn::GetLane(hn::SumOfLanes(d, shares));
  const double sum = hn::GetLane(hn::SumOfLanes(d, sums));
  return {share > 0 ? sum / share : 0.0, share};
}

/// Path sampling [eq. 15]: log Lns_n / Lns_(n-1) as the integral over k / P in [0, 1] of the mean
/// of log p_n / p_(n-1) under p^k. The integrand grows with k, so `left` underestimates and `right`
/// overestimates by J / (2 P), J the symmetrised Kullback-Leibler divergence of the two frames;
/// `trapezoid` is off by O(1 / P^2).
class PathSum {
 public:
  PathSum(LnsUpdate rule, int num_distributions) : rule_(rule), last_(num_distributions) {}
  bool used() const { return rule_ != LnsUpdate::ratio; }

  /// Adds the mean under p^k, k in [0, P].
  void Add(int k, const PathMean& at_k) {
    // The share that no longer shines leaves the sum for good: the path itself stays within the
    // common support.
    if (k == 0) log_ratio_ = at_k.share > 0 ? std::log(at_k.share) : double{kLogZero};
    const bool end = k == 0 || k == last_;
    double share = 1;
    if (rule_ == LnsUpdate::path_left && k == last_) share = 0;
    if (rule_ == LnsUpdate::path_right && k == 0) share = 0;
    if (rule_ == LnsUpdate::path_trapezoid && end) share = 0.5;
    log_ratio_ += share * at_k.mean / last_;
  }
  double log_ratio() const { return log_ratio_; }

 private:
  LnsUpdate rule_;
  int last_;
  double log_ratio_ = 0;
};

/// column_m = column_(ancestors_m).
template <class T>
HWY_INLINE void Inherit(std::size_t count, const std::int32_t* ancestors,
                        ParticleArrays::Column<T>& column) {
  T old[limits::kMaxParticles];
  std::copy_n(column.from(0), count, old);
  for (std::size_t m = 0; m < count; ++m) column[m] = old[ancestors[m]];
}

/// Resamples when the effective sample size is below the threshold; all weights become 1/N.
HWY_INLINE void ResampleIfNeeded(const SequentialSettings& settings, const Rng& rng,
                                 ParticleArrays& p, SequentialOutcome& outcome) {
  const auto count = static_cast<std::size_t>(settings.num_particles);
  if (!(outcome.ess < settings.ess_ratio_min * static_cast<float>(count))) return;
  std::int32_t ancestors[limits::kMaxParticles];
  resample(settings.resampling, p.weight.first(count), {ancestors, count}, rng, 0);
  Inherit(count, ancestors, p.code);
  Inherit(count, ancestors, p.site);
  for (auto* column : {&p.log_before, &p.log_now, &p.inverse_density, &p.r, &p.g, &p.b}) {
    Inherit(count, ancestors, *column);
  }
  std::fill_n(p.weight.from(0), count, 1.0f / static_cast<float>(count));
  outcome.resampled = true;
}

/// Puts the span's particles into arrays of whole vectors with both targets there.
template <class Target>
HWY_INLINE void LoadParticles(const Target& target, std::size_t count,
                              const ParticleSpan& particles, ParticleArrays& p) {
  const DF d;
  const bool knows_before = particles.target_before != nullptr;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    hn::Store(LoadSome(DU(), {particles.direction, count}, i), DU(), p.code.from(i));
    hn::Store(LoadBytes({particles.site, count}, i), DI(), p.site.from(i));
    hn::Store(LoadSome({particles.weight, count}, i), d, p.weight.from(i));
    if (knows_before) {
      hn::Store(LoadSome({particles.target_before, count}, i), d, p.log_before.from(i));
    }
    hn::Store(hn::Zero(d), d, p.log_increment.from(i));
  }
  // Past the last particle lie copies of it that weigh nothing.
  p.code.pad(count, p.code[count - 1]);
  p.site.pad(count, p.site[count - 1]);
  if (knows_before) p.log_before.pad(count, p.log_before[count - 1]);
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const PointLanes point{hn::Load(DU(), p.code.from(i)), hn::Load(DI(), p.site.from(i))};
    TargetLanes at;
    target.EvaluateCarried(i, point, !knows_before, at);
    if (knows_before) at.log_before = LogOrZero(hn::Load(d, p.log_before.from(i)));
    hn::Store(at.log_before, d, p.log_before.from(i));
    hn::Store(at.log_now, d, p.log_now.from(i));
    hn::Store(at.inverse_density, d, p.inverse_density.from(i));
    hn::Store(at.reflected.x, d, p.r.from(i));
    hn::Store(at.reflected.y, d, p.g.from(i));
    hn::Store(at.reflected.z, d, p.b.from(i));
  }
}

/// Carries the particles of one pixel from the target of the frame before to this frame's.
/// lns_before: estimate of the previous normalising constant, > 0. move_rng and resample_rng:
/// addressed by pixel and frame. P = 1 weights, resamples, then moves [algorithm 1]; P > 1 weights
/// and moves P times, then resamples [algorithm 2]. When the outcome is not alive the particles are
/// not usable.
template <class Target>
HWY_INLINE SequentialOutcome SequentialStep(const Target& target,
                                            const SequentialSettings& settings, float lns_before,
                                            const Rng& move_rng, const Rng& resample_rng,
                                            ParticleSpan particles) {
  const auto count = static_cast<std::size_t>(settings.num_particles);
  const int distributions = settings.num_distributions;
  SequentialOutcome outcome;
  ParticleArrays p;
  poison(p);
  LoadParticles(target, count, particles, p);

  PathSum path(settings.lns_update, distributions);
  if (path.used()) path.Add(0, MeanLogRatio(count, p, p.weight));
  double log_ratio = 0;
  const auto weight_and_resample = [&]() HWY_ATTR {
    log_ratio = ApplyIncrements(count, p, p.weight);
    if (!(log_ratio > kLogAlive)) return false;
    outcome.ess = EffectiveSize(count, p.weight);
    ResampleIfNeeded(settings, resample_rng, p, outcome);
    return true;
  };

  // Walk through the intermediate distributions p^k = p_(n-1)^(1 - k/P) p_n^(k/P).
  MoveRandom random(move_rng, count);
  const auto num_moves = static_cast<std::uint32_t>(distributions * settings.num_moves);
  for (int k = 1; k <= distributions; ++k) {
    AddIncrement(1.0f / static_cast<float>(distributions), count, p);
    if (distributions == 1 && !weight_and_resample()) return outcome;
    const float tempering_beta = static_cast<float>(k) / static_cast<float>(distributions);
    const bool keep_before = k < distributions || path.used();
    for (int m = 0; m < settings.num_moves; ++m) {
      const auto move = static_cast<std::uint32_t>((k - 1) * settings.num_moves + m);
      random.Begin(move);
      if (move % MoveRandom::kWindow == 0) {
        PrefetchProposals(target, settings, random, move,
                          std::min(move + MoveRandom::kWindow, num_moves));
      }
      MoveParticles(target, settings, tempering_beta, keep_before, random, move, p, outcome);
    }
    if (!path.used()) continue;
    ParticleArrays::Column<float> weight;
    poison(weight);
    std::copy_n(p.weight.from(0), hwy::RoundUpTo(count, hn::Lanes(DF())), weight.from(0));
    if (distributions > 1) ApplyIncrements(count, p, weight);
    path.Add(k, MeanLogRatio(count, p, weight));
  }
  if (distributions > 1 && !weight_and_resample()) return outcome;

  // Update Lns by the ratio of the weights [eq. 10] or along the path.
  outcome.lns =
      static_cast<float>(lns_before * std::exp(path.used() ? path.log_ratio() : log_ratio));
  outcome.alive = outcome.lns > 0 && std::isfinite(outcome.lns);
  const DF d;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    StoreSome(DU(), hn::Load(DU(), p.code.from(i)), {particles.direction, count}, i);
    StoreBytes(hn::Load(DI(), p.site.from(i)), {particles.site, count}, i);
    StoreSome(hn::Load(d, p.weight.from(i)), {particles.weight, count}, i);
    StoreSome(hn::Load(d, p.r.from(i)), {particles.r, count}, i);
    StoreSome(hn::Load(d, p.g.from(i)), {particles.g, count}, i);
    StoreSome(hn::Load(d, p.b.from(i)), {particles.b, count}, i);
  }
  return outcome;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
