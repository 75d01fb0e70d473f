#pragma once

#include "common/state/first_pass_samples.h"
#include "common/state/sample_state.h"
#include "worker/method/ray_batch.h"
#include "worker/pass/render_context.h"

namespace baton {

/// Gathers what the second pass will need while the first one traces a frame of a tile.
class FirstPassCollector {
 public:
  explicit FirstPassCollector(const JobSpec& job) : job_(job) {}

  /// Starts a frame; state: the samples in work.
  void begin(const SampleState& state);
  /// Takes the traced rays of a pixel, all at once.
  void add_rays(const SampleState& state, std::size_t pixel, const FoundRays& found);
  /// Ends the frame.
  FirstPassSamples finish(const SampleState& state, Step step);

 private:
  void add_ray(const SampleState& state, std::size_t particle, bool occluded);
  /// One of the columns of samples, pixel after pixel.
  template <class T>
  void put_in_order(std::vector<T>& column) const;

  const JobSpec& job_;
  FirstPassSamples samples_;          ///< pixels in the order in which they came
  std::vector<std::uint32_t> first_;  ///< (pixels) where the samples of each begin
};

}  // namespace baton
