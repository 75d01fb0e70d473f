#pragma once

#include "common/state/sample_state.h"
#include "worker/integrator/ray_batch.h"

namespace baton {

/// Forgets the samples of a pixel whose rays were blocked. What is left of a properly weighted set
/// for p~ is one for p~ V, its Lns the light that arrives. rays [first, end): those of pixel
/// `index` of the state; its sample 0 has number first_sample. One population.
void forget_blocked(const RayBatch& rays, std::size_t first, std::size_t end,
                    std::uint32_t first_sample, std::size_t index, SampleState& state);

}  // namespace baton
