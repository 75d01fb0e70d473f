#pragma once

#include <array>
#include <vector>

#include "common/image/film_tile.h"
#include "common/job/job_spec.h"
#include "worker/pass/film_writer.h"
#include "worker/pass/round_scatter.h"

namespace baton {

/// The sums of one pixel over the rounds of its frame.
struct PixelSum {
  std::array<double, 3> radiance{}, normal{}, source{}, shadow{}, blocked{}, indirect{};
  double alpha = 0, coverage = 0, depth = 0, catcher = 0;
  double lns = 0, arrived = 0;  ///< arrived: Lns x visibility
  double ess_ratio = 0, acceptance = 0, acceptance_local = 0, acceptance_independent = 0;
  double resampled = 0, mask = 0;
  RoundScatter scatter;  ///< scatter of the radiance
  /// What is shown: grey radiance and shadow; and its squares.
  double seen = 0, seen_squares = 0;
  std::int32_t num_rounds = 0;
  std::uint32_t material = 0;  ///< as in the first round that sees one
  double weight_seen = 0;      ///< weight of rounds that see a surface
};

/// A frame of a tile as the mean of its rounds, each with its weight; those of a pixel add up to
/// quality.rounds. Colours, alpha, Lns: over all rounds. Depth and
/// normal: over the sites that see a surface; visibility: share of all rounds' light; what a method
/// did: over the rounds that see a surface. variance and error: from the scatter of the rounds,
/// sites included, which is told where they are uncorrelated, as they are for all methods that
/// carry no samples; with carried samples 0 and unknown.
class RoundMean {
 public:
  RoundMean(const JobSpec& job, const PixelRect& rect);

  /// Adds pixel `index` of a round; rounds must come in turn. weight: rounds that it stands for.
  void add(std::size_t index, const PixelResult& pixel, double weight = 1);
  /// Squared noise of the mean of quality.rounds rounds of pixel `index`, as Cycles measures it
  /// (common/image/noise.h), by the scatter of those so far, two or more of weight 1. A shadow on a
  /// plate counts as light.
  double squared_noise(std::size_t index) const;
  /// The mean; after the last round, once.
  const FilmTile& finish();

 private:
  PixelResult mean(const PixelSum& sum) const;

  const std::int32_t num_rounds_;
  const bool rounds_are_uncorrelated_, some_judge_;
  FilmWriter film_;
  std::vector<PixelSum> sums_;  ///< empty for a single round
};

}  // namespace baton
