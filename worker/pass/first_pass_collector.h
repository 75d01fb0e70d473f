#pragma once

#include "common/state/first_pass_samples.h"
#include "common/state/sample_state.h"
#include "worker/pass/render_context.h"

namespace baton {

/// Gathers what the second pass will need while the first one traces a frame of a tile.
class FirstPassCollector {
 public:
  explicit FirstPassCollector(const JobSpec& job) : job_(job) {}

  /// Starts a frame; state: the samples in work.
  void begin(const SampleState& state);
  /// Takes a traced ray; they must come by particle, ascending. particle: pixel * N + j.
  void add_ray(const SampleState& state, std::size_t particle, bool occluded);
  /// Ends the frame.
  FirstPassSamples finish(const SampleState& state, std::int32_t frame_index);

 private:
  const JobSpec& job_;
  FirstPassSamples samples_;
};

/// Factor of population k's contributions in the picture of the first pass: 1, but where one half
/// only decides.
float picture_scale(const JobSpec& job, std::int32_t population);

}  // namespace baton
