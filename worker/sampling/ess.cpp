#include "worker/sampling/ess.h"

namespace baton {

float effective_sample_size(std::span<const float> weights) {
  double sum = 0;
  double sum_squares = 0;
  for (const float w : weights) {
    sum += w;
    sum_squares += double{w} * w;
  }
  return sum_squares > 0 ? static_cast<float>(sum * sum / sum_squares) : 0.0f;
}

}  // namespace baton
