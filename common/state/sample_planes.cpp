#include "common/state/sample_planes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/limits.h"

namespace baton {
namespace {

constexpr SectionTag kLns{'L', 'N', 'S', '_'};
constexpr SectionTag kLnsFresh{'L', 'N', 'S', 'F'};
constexpr SectionTag kDirection{'D', 'I', 'R', '_'};
constexpr SectionTag kWeight{'W', 'G', 'T', '_'};
constexpr SectionTag kSite{'S', 'I', 'T', 'E'};
constexpr SectionTag kConfidence{'C', 'O', 'N', 'F'};
/// The planes of samples in their order, and the bytes of an element.
constexpr std::pair<SectionTag, std::size_t> kPlanes[] = {{kLns, sizeof(float)},
                                                          {kLnsFresh, sizeof(float)},
                                                          {kDirection, sizeof(OctDirection)},
                                                          {kWeight, sizeof(float)},
                                                          {kSite, sizeof(std::uint8_t)}};
static_assert(std::size(kPlanes) == SampleFormat::kNumPlanes);

/// How far the sum of a pixel's weights may be from 1.
constexpr double kWeightSumTolerance = 1e-3;

/// How many of `pixels` start and end with the same weight, as all do after a resampling.
std::size_t num_resampled(const SampleState& state, const std::vector<std::size_t>& pixels) {
  const auto count = static_cast<std::size_t>(state.num_particles);
  if (count == 0) return 0;
  const auto all = ConstSamplePlanes(state).weight;
  return static_cast<std::size_t>(std::ranges::count_if(pixels, [&](std::size_t pixel) {
    return all[pixel * count] == all[pixel * count + count - 1];
  }));
}

/// Checks the values of population k of a surface pixel.
Status check_population(const StateReader& from, const SampleState& state, std::size_t pixel,
                        std::size_t k) {
  // Lns: radiance.
  const ConstSamplePlanes samples(state);
  const std::size_t row = pixel * static_cast<std::size_t>(state.num_populations) + k;
  for (const auto& [tag, value] :
       {std::pair{kLns, samples.lns[row]}, {kLnsFresh, samples.lns_fresh[row]}}) {
    if (!(std::isfinite(value) && value >= 0)) {
      return from.wrong_value(tag, pixel, fmt::format("{}, expected a finite number >= 0", value));
    }
  }

  // Particles: each weight and site, then the sum.
  const auto num_particles = static_cast<std::size_t>(state.num_particles);
  const std::size_t count = num_particles / static_cast<std::size_t>(state.num_populations);
  double sum = 0;
  for (std::size_t i = k * count; i < (k + 1) * count; ++i) {
    const float weight = samples.weight[pixel * num_particles + i];
    const int site = samples.site[pixel * num_particles + i];
    if (!(std::isfinite(weight) && weight >= 0)) {
      return from.wrong_value(
          kWeight, pixel,
          fmt::format("particle {} has weight {}, expected a finite number >= 0", i, weight));
    }
    if (site >= limits::kMaxSites) {
      return from.wrong_value(
          kSite, pixel,
          fmt::format("particle {} has site {}, expected 0 to {}", i, site, limits::kMaxSites - 1));
    }
    sum += weight;
  }
  if (sum != 0 && std::fabs(sum - 1) > kWeightSumTolerance)
    return from.wrong_value(kWeight, pixel, fmt::format("weights sum to {}, expected 1 or 0", sum));
  return {};
}

}  // namespace

std::vector<std::size_t> SampleFormat::pixel_bytes(std::int32_t num_particles,
                                                   std::int32_t num_populations) const {
  std::vector<std::size_t> sizes;
  for (const auto& [tag, element] : kPlanes) {
    const bool is_lns = tag == kLns || tag == kLnsFresh;
    sizes.push_back(static_cast<std::size_t>(is_lns ? num_populations : num_particles) * element);
  }
  return sizes;
}

std::vector<SectionTag> SampleFormat::tags() const {
  std::vector<SectionTag> tags;
  for (const auto& [tag, element] : kPlanes) tags.push_back(tag);
  return tags;
}

void SampleFormat::encode(const SampleState& state, StateWriter& out) const {
  for (std::size_t i = 0; i < kNumPlanes; ++i) {
    const auto& [tag, element] = kPlanes[i];
    out.gather(tag, element, state.planes[i]);
    // Directions are as good as random, sites nearly so, and so are weights unless most pixels were
    // just resampled: finding repetitions costs more time than it saves bytes.
    const auto is_set = [](std::byte site) { return site != std::byte{0}; };
    const bool is_random =
        tag == kDirection ||
        (tag == kWeight && 2 * num_resampled(state, out.pixels()) < out.pixels().size()) ||
        (tag == kSite && std::ranges::any_of(out.last_payload(), is_set));
    if (is_random) out.keep_plain();
  }
}

Status SampleFormat::decode(const StateReader& from, SampleState& state) const {
  for (std::size_t i = 0; i < kNumPlanes; ++i)
    BATON_TRY(from.scatter(kPlanes[i].first, state.planes[i]));
  for (const std::size_t pixel : from.pixels()) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(state.num_populations); ++k)
      BATON_TRY(check_population(from, state, pixel, k));
  }
  return {};
}

void SampleFormat::move_to_sites(SampleState& state, std::size_t pixel,
                                 const HeirOf& heir_of) const {
  const auto count = static_cast<std::size_t>(state.num_particles);
  const auto sites = SamplePlanes(state).site.subspan(pixel * count, count);
  for (std::size_t j = 0; j < count; ++j) sites[j] = heir_of(sites[j], j);
}

const SampleFormat& sample_format() {
  static const SampleFormat format;
  return format;
}

std::vector<std::size_t> WeighedSampleFormat::pixel_bytes(std::int32_t num_particles,
                                                          std::int32_t num_populations) const {
  std::vector<std::size_t> sizes = SampleFormat::pixel_bytes(num_particles, num_populations);
  sizes.push_back(sizeof(std::uint16_t));
  return sizes;
}

std::vector<SectionTag> WeighedSampleFormat::tags() const {
  std::vector<SectionTag> tags = SampleFormat::tags();
  tags.push_back(kConfidence);
  return tags;
}

void WeighedSampleFormat::encode(const SampleState& state, StateWriter& out) const {
  SampleFormat::encode(state, out);
  out.gather(kConfidence, sizeof(std::uint16_t), state.planes[kNumPlanes]);
}

Status WeighedSampleFormat::decode(const StateReader& from, SampleState& state) const {
  BATON_TRY(SampleFormat::decode(from, state));
  return from.scatter(kConfidence, state.planes[kNumPlanes]);
}

const WeighedSampleFormat& weighed_sample_format() {
  static const WeighedSampleFormat format;
  return format;
}

float mean_lns(const SampleState& state, std::size_t pixel) {
  const auto count = static_cast<std::size_t>(state.num_populations);
  const auto lns = ConstSamplePlanes(state).lns.subspan(pixel * count, count);
  float sum = 0;
  for (const float one : lns) sum += one;
  return sum / static_cast<float>(count);
}

}  // namespace baton
