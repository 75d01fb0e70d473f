#pragma once

#include <span>

namespace baton {

/// Effective sample size (sum w)^2 / sum w^2 of non-negative weights, normalised or not [Kong
/// 1992]. weights: (N,). Returns [1, N], or 0 if every weight is zero.
float effective_sample_size(std::span<const float> weights);

}  // namespace baton
