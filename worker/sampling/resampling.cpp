#include "worker/sampling/resampling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/base/check.h"
#include "common/base/limits.h"

namespace baton {
namespace {

constexpr std::size_t kMaxChoices = limits::kMaxParticles;

/// Inverts the distribution function of `weights` at ascending positions in [0, total).
void invert_sorted(std::span<const float> weights, std::span<const float> positions,
                   std::span<std::int32_t> out) {
  const auto last_positive = [&] {
    std::size_t last = weights.size() - 1;
    while (last > 0 && !(weights[last] > 0)) --last;
    return last;
  }();
  std::size_t j = 0;
  float cumulative = weights[0];
  for (std::size_t m = 0; m < positions.size(); ++m) {
    // Rounding may leave the last positions past the sum: they belong to the last particle that
    // lives.
    while (cumulative <= positions[m] && j < last_positive) cumulative += weights[++j];
    out[m] = static_cast<std::int32_t>(j);
  }
}

/// Uniforms of (step, index / 4 ...), one per position.
float uniform_at(const Rng& rng, std::uint32_t step, std::size_t index) {
  return rng.uniforms(step, static_cast<std::uint32_t>(index / 4))[index % 4];
}

void multinomial(std::span<const float> weights, float total, std::span<std::int32_t> out,
                 const Rng& rng, std::uint32_t step) {
  std::array<float, kMaxChoices> positions{};
  for (std::size_t m = 0; m < out.size(); ++m) positions[m] = uniform_at(rng, step, m) * total;
  std::sort(positions.begin(), positions.begin() + static_cast<std::ptrdiff_t>(out.size()));
  invert_sorted(weights, std::span(positions).first(out.size()), out);
}

void residual(std::span<const float> weights, std::span<std::int32_t> out, const Rng& rng,
              std::uint32_t step) {
  std::array<float, kMaxChoices> rest{};
  float rest_total = 0;
  std::size_t filled = 0;
  for (std::size_t j = 0; j < weights.size(); ++j) {
    const float expected = weights[j] * static_cast<float>(out.size());
    const auto copies = std::min(static_cast<std::size_t>(expected), out.size() - filled);
    for (std::size_t c = 0; c < copies; ++c) out[filled++] = static_cast<std::int32_t>(j);
    rest[j] = expected - static_cast<float>(copies);
    rest_total += rest[j];
  }
  if (filled < out.size()) {
    multinomial(std::span<const float>(rest).first(weights.size()), rest_total, out.subspan(filled),
                rng, step);
  }
}

}  // namespace

void resample(ResamplingScheme scheme, std::span<const float> weights,
              std::span<std::int32_t> ancestors, const Rng& rng, std::uint32_t step) {
  BATON_CHECK(!weights.empty() && weights.size() <= kMaxChoices && ancestors.size() <= kMaxChoices);
  std::array<float, kMaxChoices> positions{};
  const std::span<float> used = std::span(positions).first(ancestors.size());
  const auto count = static_cast<float>(ancestors.size());
  switch (scheme) {
    case ResamplingScheme::systematic: {
      const float u = uniform_at(rng, step, 0);
      for (std::size_t m = 0; m < used.size(); ++m) used[m] = (static_cast<float>(m) + u) / count;
      return invert_sorted(weights, used, ancestors);
    }
    case ResamplingScheme::stratified:
      for (std::size_t m = 0; m < used.size(); ++m) {
        used[m] = (static_cast<float>(m) + uniform_at(rng, step, m)) / count;
      }
      return invert_sorted(weights, used, ancestors);
    case ResamplingScheme::multinomial:
      return multinomial(weights, 1, ancestors, rng, step);
    case ResamplingScheme::residual:
      return residual(weights, ancestors, rng, step);
  }
}

}  // namespace baton
