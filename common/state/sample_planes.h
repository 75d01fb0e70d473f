#pragma once

#include <cstdint>
#include <span>
#include <type_traits>

#include "common/math/octahedral.h"
#include "common/state/state_format.h"

namespace baton {

/// The planes of weighted samples, borrowed from a state.
template <class State>
struct SamplePlanesOf {
  template <class T>
  using Plane = std::span<std::conditional_t<std::is_const_v<State>, const T, T>>;
  /// (pixels, K) estimate of the unshadowed radiance, mean over RGB.
  Plane<float> lns;
  /// (pixels, K) Lns at the last SIR or refresh.
  Plane<float> lns_fresh;
  Plane<OctDirection> direction;  ///< (pixels, N)
  /// (pixels, N) normalised, sum 1 in each population, or all 0 when no particle is lit.
  Plane<float> weight;
  Plane<std::uint8_t> site;  ///< (pixels, N)

  explicit SamplePlanesOf(State& state)
      : lns(state.planes[0].template values<float>()),
        lns_fresh(state.planes[1].template values<float>()),
        direction(state.planes[2].template values<OctDirection>()),
        weight(state.planes[3].template values<float>()),
        site(state.planes[4].template values<std::uint8_t>()) {}
};
using SamplePlanes = SamplePlanesOf<SampleState>;
using ConstSamplePlanes = SamplePlanesOf<const SampleState>;

/// Weighted samples. A format that adds planes has those of samples first.
class SampleFormat : public StateFormat {
 public:
  static constexpr std::size_t kNumPlanes = 5;

  std::int32_t fewest_particles() const override { return 1; }
  std::vector<std::size_t> pixel_bytes(std::int32_t num_particles,
                                       std::int32_t num_populations) const override;
  std::vector<SectionTag> tags() const override;
  void encode(const SampleState& state, StateWriter& out) const override;
  /// Errors: weights or Lns that are negative or not finite, weights whose sum is neither 1 nor 0,
  /// sites past the last.
  Status decode(const StateReader& from, SampleState& state) const override;
  void move_to_sites(SampleState& state, std::size_t pixel, const HeirOf& heir_of) const override;
};
const SampleFormat& sample_format();

/// Samples, and how many fresh sets they count as when they are weighed against fresh ones.
class WeighedSampleFormat final : public SampleFormat {
 public:
  std::vector<std::size_t> pixel_bytes(std::int32_t num_particles,
                                       std::int32_t num_populations) const override;
  std::vector<SectionTag> tags() const override;
  void encode(const SampleState& state, StateWriter& out) const override;
  Status decode(const StateReader& from, SampleState& state) const override;
};
const WeighedSampleFormat& weighed_sample_format();

/// (pixels) 0: the samples are no history. Of a state of weighed_sample_format().
inline std::span<std::uint16_t> confidence_plane(SampleState& state) {
  return state.planes[SampleFormat::kNumPlanes].values<std::uint16_t>();
}
inline std::span<const std::uint16_t> confidence_plane(const SampleState& state) {
  return state.planes[SampleFormat::kNumPlanes].values<std::uint16_t>();
}

/// Mean over the populations of a pixel.
float mean_lns(const SampleState& state, std::size_t pixel);

/// u_j / K = unit_contribution * weight_j of a particle of population k: the contributions of all
/// particles of a pixel together estimate its Lns.
inline float unit_contribution(const SampleState& state, std::size_t pixel, std::size_t k) {
  return ConstSamplePlanes(state).lns[pixel * static_cast<std::size_t>(state.num_populations) + k] /
         static_cast<float>(state.num_populations);
}

}  // namespace baton
