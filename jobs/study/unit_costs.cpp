#include "jobs/study/unit_costs.h"

namespace baton {
namespace {

constexpr double kPixelUs = 1.17;       // surfaces, film
constexpr double kShadowRayUs = 0.107;  // trace and shade one sample
constexpr double kEvaluationUs = 0.0166;
constexpr double kMoveUs = 0.0085;  // a proposal's random numbers and choice, beside its evaluation

}  // namespace

double counted_cost_us(const RunCounts& counts) {
  const auto count = [](std::uint64_t n) { return static_cast<double>(n); };
  return kPixelUs * count(counts.lit_pixels()) + kShadowRayUs * count(counts.rays_shadow) +
         kEvaluationUs * count(counts.target_evaluations) + kMoveUs * count(counts.moves_proposed);
}

}  // namespace baton
