#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/job/job_spec.h"

namespace baton {

/// Under this name a settled job says in its metadata what was chosen.
inline constexpr const char* kAutoChoice = "auto.choice";

/// N that are tried when N is to be chosen, and those that may be chosen.
inline constexpr int kPilotParticles[] = {4, 32};
inline constexpr int kParticlesToChoose[] = {1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64};
/// Whether N is to be chosen: with a target error or a time budget.
bool chooses_particles(const SamplingSpec& asked);

/// A way to render a job, as a pilot may try it.
struct AutoCandidate {
  /// E.g. "bidirectional M=128"; members of a family differ in N alone.
  std::string family;
  SamplingSpec sampling;
  /// With the second pass of correlated visibility.
  bool correlated = false;

  std::string name() const;
};

/// What `"method": "auto"` tries for a job, simplest first: of equally good ones the first is
/// taken. Left out is what the job cannot need: carrying samples where there is one frame or no
/// state, N past what was asked for.
std::vector<AutoCandidate> auto_candidates(const JobSpec& job);

/// What a pilot saw of a candidate.
struct PilotNumbers {
  AutoCandidate candidate;
  double error = 0;  ///< RMSE over mean radiance
  /// counted_cost_us per pixel with a surface and frame.
  double cost_us = 0;
};

struct AutoChoice {
  SamplingSpec sampling;  ///< never `auto`
  bool correlated = false;
  double error = 0;  ///< expected, as PilotNumbers
  double cost_us = 0;
  std::string reason;
};

/// The cheapest of what was tried that reaches the job's targetError, or the most accurate within
/// its timeBudget, or the one with the best 1 / (error^2 x cost). With a target or budget, N is
/// chosen between the tried ones by interpolation (logarithms of error and cost against that of N).
/// A candidate takes over from a simpler one only when it is better by 5 %.
/// pilot: not empty. lit_pixels: pixels with a surface times frames of the whole job.
AutoChoice choose_sampling(const JobSpec& job, std::span<const PilotNumbers> pilot,
                           double lit_pixels);

/// Writes the choice into the job, and what was seen and why as metadata.
void apply_choice(const AutoChoice& choice, std::span<const PilotNumbers> pilot, JobSpec& job);

}  // namespace baton
