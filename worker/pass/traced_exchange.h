#pragma once

#include "worker/integrator/exchange_kernels.h"
#include "worker/pass/masked_surfaces.h"
#include "worker/pass/sample_region.h"
#include "worker/sampling/energy_exchange.h"

namespace baton {

/// The exchange of energy over real surfaces: products by SIMD, visibility by rays.
class TracedExchange final : public ExchangeScene {
 public:
  /// All arguments must outlive the object. exchange_rect: the rectangle of the masks.
  TracedExchange(const Accel& accel, const EnvironmentView& environment,
                 const SampleRegion& samples, const MaskedSurfaces& surfaces,
                 const PixelRect& exchange_rect, std::int32_t num_sites);

  /// Gives the samples of this fold's population from here on.
  void use(const Fold& fold) { fold_ = fold; }
  void append_samples(std::int32_t x, std::int32_t y, std::vector<GiverSample>& batch) override;
  void receive(std::span<const Offer> offers, std::span<Reflected> receptions) override;
  float lns(std::uint32_t receiver) const override;

  std::uint64_t rays_traced() const { return rays_traced_; }
  double seconds_rays() const { return seconds_rays_; }

 private:
  float lns(const SampleRegion::Place& place) const;

  const Accel& accel_;
  const EnvironmentView& environment_;
  const SampleRegion& samples_;
  const MaskedSurfaces& surfaces_;
  const PixelRect rect_;
  const std::int32_t num_sites_;
  Fold fold_;
  std::vector<LightRecord> light_;  ///< (batch)
  std::vector<Reflected> own_;      ///< what a giver's own surfaces make of its samples
  std::vector<LitSurface> pairs_;
  ShadowRays rays_;
  std::vector<std::uint32_t> offer_of_ray_;
  std::uint64_t rays_traced_ = 0;
  double seconds_rays_ = 0;
};

}  // namespace baton
