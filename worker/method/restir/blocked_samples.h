#pragma once

#include "common/state/sample_planes.h"
#include "worker/method/ray_batch.h"

namespace baton {

/// Forgets the samples of pixel `index` whose rays were blocked. What is left of a properly
/// weighted set for p~ is one for p~ V, its Lns the light that arrives. One population.
void forget_blocked(const FoundRays& found, std::size_t index, SampleState& state);

}  // namespace baton
