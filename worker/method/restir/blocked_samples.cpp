#include "worker/method/restir/blocked_samples.h"

#include <numeric>
#include <span>

#include "common/base/check.h"

namespace baton {

void forget_blocked(const FoundRays& found, std::size_t index, SampleState& state) {
  BATON_CHECK(state.num_populations == 1);
  const auto n = static_cast<std::size_t>(state.num_particles);
  const SamplePlanes samples(state);
  const std::span<float> weights = samples.weight.subspan(index * n, n);
  for (std::size_t i = 0; i < found.sample.size(); ++i) {
    if (!found.free(i)) weights[found.sample[i]] = 0;
  }
  const float left = std::accumulate(weights.begin(), weights.end(), 0.0f);
  if (left > 0) {
    for (float& weight : weights) weight /= left;
  }
  samples.lns[index] *= left;
  samples.lns_fresh[index] *= left;
}

}  // namespace baton
