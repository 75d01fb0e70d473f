#include "worker/pass/blocked_samples.h"

#include <numeric>
#include <span>

#include "common/base/check.h"

namespace baton {

void forget_blocked(const RayBatch& rays, std::size_t first, std::size_t end,
                    std::uint32_t first_sample, std::size_t index, SampleState& state) {
  BATON_CHECK(state.num_populations == 1);
  const auto n = static_cast<std::size_t>(state.num_particles);
  const std::span<float> weights = std::span(state.weight).subspan(index * n, n);
  for (std::size_t r = first; r < end; ++r) {
    if (rays.rays.t_far[r] < 0) weights[rays.sample[r] - first_sample] = 0;
  }
  const float left = std::accumulate(weights.begin(), weights.end(), 0.0f);
  if (left > 0) {
    for (float& weight : weights) weight /= left;
  }
  state.lns[index] *= left;
  state.lns_fresh[index] *= left;
}

}  // namespace baton
