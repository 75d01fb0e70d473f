#pragma once

#include <cstdint>

namespace baton {

/// The numbers of the pool sampler that no theory gives. None of them can bias: they say where
/// candidates and rays go. docs/lab/pool.md shows what half and twice of each does
/// (jobs/lab/studies/study_pool_tuning.cpp).
struct PoolTuning {
  /// What a pixel's noise is compared with: the light that it expects and so many times the mean
  /// radiance of the environment, as nobody sees the noise of dark pixels among bright ones.
  float surroundings = 1;

  /// Rays that the guess of coarser bins counts as, in what a bin expects (VisibilityTable).
  float prior_rays = 6;
  /// Rays that what its block expects counts as, beside a pixel's own (PixelVisibility).
  float own_prior_rays = 32;

  /// Least factor on a candidate's weight where V^ is the control variate: candidates whose
  /// visibility has no variance still get some rays.
  float least_deviation = 0.05f;
  /// Least factor on a candidate's weight where V^ is no control variate. A lamp that is always
  /// blocked leaves rays to the rest.
  float least_contribution = 0.05f;
  /// V^ is the control variate where the expected light is so many times its deviation. Later
  /// loses; earlier, a blocked ray may leave a value below zero more often.
  float control_from = 1.5f;
  /// Standard deviation of visibility over noise_scale() that gives N rays.
  float usual_deviation = 0.025f;
  /// Least share of N rays.
  float least_rays = 0.5f;

  /// Candidates of a kind.
  struct Candidates {
    /// Noise over noise_scale() that gives the usual number.
    float usual_noise;
    /// Share of the usual number that every pixel gets.
    float least;
  };
  Candidates light{0.0015f, 0.25f};
  /// Those from lobes take more time, and too few of them miss lamps without showing any noise.
  Candidates lobes{0.004f, 1};
  /// Most candidates of a kind, times the usual number.
  float most_candidates = 64;
  /// Fewest candidates of the light: the noise estimate needs second differences, so three vectors
  /// of eight. With fewer a pixel would measure no noise and keep too few for good.
  std::int32_t fewest_judged = 24;
  /// Glossy pixels that usually have so many may go below: if their noise from the light is small,
  /// candidates from lobes bring most of their light.
  std::int32_t enough_beside_lobes = 64;
  /// Weight of a new frame in the noise that is remembered.
  float new_frame = 0.25f;
};

}  // namespace baton
