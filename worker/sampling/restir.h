#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/limits.h"

namespace baton {

/// The arithmetic of ReSTIR DI [Bitterli et al. 2020], with the generalised balance heuristic over
/// whole domains [Lin et al. 2022, section 5.6] in place of the paper's normalisation.
///
/// Each set t has samples y with contributions u, E[sum u h(y)] = integral of p~_t h, for a
/// target p~_t that may be evaluated anywhere; set 0 is fresh, and p~_0 = p~, the target of now. A
/// sample's weight for p~ is
///   u c_t p~(y) / sum_k c_k p~_k(y),
/// so that the sum over all sets of weight times h has the integral of p~ h as expectation: at each
/// y that p~ reaches, the sets' shares sum to 1. That is so for correlated sets, too, since it is
/// linear in the u, but only while the confidences c depend on no sample; and no estimated integral
/// of p~_t may stand in the sum.

inline constexpr std::size_t kMaxRestirSets = 2 + limits::kMaxNeighbors;

/// Samples [end of the set before, end) of all, and what is known of their set.
struct RestirSet {
  std::size_t end = 0;
  float confidence = 1;  ///< c, >= 0
  /// p~_t at the samples of all sets; null: that of this frame (fresh).
  const float* target_before = nullptr;
};

/// weight[i] of all samples. contribution, target_now: at all samples; set 0 is the fresh one.
/// Returns the sum of the weights: an estimate of the integral of p~.
double weigh_restir_sets(std::span<const RestirSet> sets, std::span<const float> contribution,
                         std::span<const float> target_now, std::span<float> weight);

/// Chooses systematically: picks[m] is the sample that contains position (m + u) total /
/// picks.size() of the weights laid end to end; never one of weight 0. total: their sum, > 0. u:
/// [0, 1).
void pick_systematically(std::span<const float> weight, double total, float u,
                         std::span<std::uint32_t> picks);

/// What the sets combined count as in the next frame: the sum of their confidences, at most
/// `history_limit`.
std::uint16_t next_confidence(std::span<const RestirSet> sets, std::int32_t history_limit);

}  // namespace baton
