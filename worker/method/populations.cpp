#include "worker/method/populations.h"

#include <algorithm>

#include "common/base/poison.h"
#include "common/job/plan/sequence.h"

namespace baton {

SamplingSpec population_spec(const JobSpec& job) {
  SamplingSpec spec = job.sampling;
  spec.num_particles /= num_populations(job);
  spec.num_candidates = std::max(spec.num_candidates / num_populations(job), spec.num_particles);
  spec.refresh_candidates =
      std::max(spec.refresh_candidates / num_populations(job), spec.num_particles);
  return spec;
}

std::uint64_t stream_seed(std::uint64_t job_seed, std::uint32_t stream) {
  if (stream == 0) return job_seed;
  const Philox4x32::Counter bits = Philox4x32::block({stream, 0, 0, 0}, job_seed);
  return std::uint64_t{bits[1]} << 32 | bits[0];
}

PixelDiagnostics sample_populations(const PixelSampler& sampler, std::size_t num_particles,
                                    const PixelInput& input, std::size_t index,
                                    SamplerScratch& scratch, SampleState& state,
                                    SampleColors& colors) {
  const auto populations = static_cast<std::size_t>(state.num_populations);
  const std::size_t stride = static_cast<std::size_t>(state.num_particles) / populations;
  const std::size_t n = num_particles / populations;
  const auto samples_of = [&](std::size_t k) {
    const std::size_t row = index * populations + k;
    return PixelSamples{std::span(state.direction).subspan(row * stride, n),
                        std::span(state.site).subspan(row * stride, n),
                        std::span(state.weight).subspan(row * stride, n),
                        std::span(colors.r).subspan(k * n, n),
                        std::span(colors.g).subspan(k * n, n),
                        std::span(colors.b).subspan(k * n, n),
                        state.lns[row],
                        state.lns_fresh[row],
                        state.source[row],
                        state.confidence.empty() ? nullptr : &state.confidence[row]};
  };
  poison(colors);
  PixelDiagnostics sum{.num_samples = static_cast<std::int32_t>(n * populations)};
  PixelInput population_input = input;
  for (std::size_t k = 0; k < populations; ++k) {
    population_input.key.job_seed = stream_seed(input.key.job_seed, static_cast<std::uint32_t>(k));
    if (!input.target_before.empty()) {
      population_input.target_before = input.target_before.subspan(k * n, n);
    }
    if (!input.located.empty()) population_input.located = input.located.subspan(k, 1);
    const PixelDiagnostics did = sampler.sample(population_input, scratch, samples_of(k));
    sum.ess += did.ess;
    sum.target_evaluations += did.target_evaluations;
    sum.local.proposed += did.local.proposed;
    sum.local.accepted += did.local.accepted;
    sum.independent.proposed += did.independent.proposed;
    sum.independent.accepted += did.independent.accepted;
    sum.refreshed_by_ratio = sum.refreshed_by_ratio || did.refreshed_by_ratio;
    sum.resampled = sum.resampled || did.resampled;
  }
  return sum;
}

namespace {

void set_source(SampleState& state, std::size_t index, PixelSource source) {
  const auto k = static_cast<std::ptrdiff_t>(state.num_populations);
  std::fill_n(state.source.begin() + static_cast<std::ptrdiff_t>(index) * k, k, source);
}

}  // namespace

void set_background(SampleState& state, std::size_t index) {
  set_source(state, index, PixelSource::background);
}

void set_catcher(SampleState& state, std::size_t index) {
  set_source(state, index, PixelSource::catcher);
}

float mean_lns(const SampleState& state, std::size_t index) {
  const auto k = static_cast<std::size_t>(state.num_populations);
  float sum = 0;
  for (std::size_t row = index * k; row < (index + 1) * k; ++row) sum += state.lns[row];
  return sum / static_cast<float>(k);
}

PixelSource latest_source(const SampleState& state, std::size_t index) {
  const auto k = static_cast<std::ptrdiff_t>(state.num_populations);
  const auto first = state.source.begin() + static_cast<std::ptrdiff_t>(index) * k;
  return *std::max_element(first, first + k);
}

}  // namespace baton
