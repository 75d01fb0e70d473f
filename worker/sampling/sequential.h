#pragma once

#include <cstdint>

#include "common/job/job_spec.h"
#include "common/math/octahedral.h"

namespace baton {

/// Settings of the sequential sampler, from SamplingSpec.
struct SequentialSettings {
  int num_particles = 16;
  int num_distributions = 5;  ///< P
  int num_moves = 1;          ///< moves per distribution
  float ess_ratio_min = 0.5f;
  ResamplingScheme resampling = ResamplingScheme::systematic;
  LnsUpdate lns_update = LnsUpdate::ratio;
  float local_move_cosine = 1;  ///< cosine of the half-angle of local moves
  float local_move_fraction = 0.125f;
};

/// The particles of one pixel, borrowed: (N,) each.
struct ParticleSpan {
  OctDirection* direction = nullptr;
  std::uint8_t* site = nullptr;
  float* weight = nullptr;                         ///< normalised, sum 1
  float *r = nullptr, *g = nullptr, *b = nullptr;  ///< out: (f cos L)_rgb at the particles
  /// Target of the frame before at the particles, where it is known from then; null: evaluate it.
  /// Only with surfaces that stay.
  const float* target_before = nullptr;
};

/// Metropolis-Hastings moves of one kind.
struct MoveCounts {
  std::int32_t proposed = 0;
  std::int32_t accepted = 0;
};

/// What the sampler did in one frame.
struct SequentialOutcome {
  /// False: all weights died or Lns is not a positive finite number; start again with SIR.
  bool alive = false;
  float lns = 0;  ///< new estimate of the normalising constant
  float ess = 0;  ///< before resampling, [1, N]
  bool resampled = false;
  MoveCounts local;        ///< perturbations of the direction
  MoveCounts independent;  ///< fresh directions from the map
};

/// Stands for log 0 where sums and products must stay finite: exp() of any multiple is 0.
inline constexpr float kLogZero = -1e30f;
/// Anything below is log 0 or a fraction of it: no positive float has so small a logarithm.
inline constexpr float kLogAlive = -1e20f;

}  // namespace baton
