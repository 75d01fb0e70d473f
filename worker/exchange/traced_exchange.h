#pragma once

#include "worker/exchange/energy_exchange.h"
#include "worker/exchange/exchange_kernels.h"
#include "worker/exchange/second_pass_work.h"
#include "worker/sampling/folds.h"

namespace baton {

/// The exchange of energy over real surfaces: products by SIMD, visibility by rays.
class TracedExchange final : public ExchangeScene {
 public:
  /// work must outlive the object.
  explicit TracedExchange(const SecondPassWork& work)
      : work_(work), environment_(view_of(work.light.now)) {}

  /// Gives the samples of this fold's population from here on.
  void use(const Fold& fold);
  void load_samples(std::span<Giver> givers, std::vector<GiverSample>& batch) override;
  void receive(std::span<const Offer> offers, std::span<Reflected> receptions) override;
  std::span<const float> lns() const override { return lns_; }

  std::uint64_t rays_traced() const { return rays_traced_; }
  double seconds_rays() const { return seconds_rays_; }

 private:
  const SecondPassWork& work_;
  const EnvironmentView environment_;
  Fold fold_;
  /// (masked pixels) for the published forms, else empty.
  std::vector<float> lns_;
  std::vector<OctDirection> code_;
  std::vector<LightRecord> light_;  ///< (batch)
  std::vector<Offer> own_offers_;   ///< every sample to its own surface
  std::vector<Reflected> own_;      ///< what that makes of it
  OfferRays rays_;
  std::uint64_t rays_traced_ = 0;
  double seconds_rays_ = 0;
};

}  // namespace baton
