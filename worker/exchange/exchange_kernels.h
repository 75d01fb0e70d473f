#pragma once

#include <cstdint>
#include <span>

#include "common/math/octahedral.h"
#include "worker/accel/accel.h"
#include "worker/exchange/energy_exchange.h"
#include "worker/exchange/surface_table.h"
#include "worker/surface/environment_view.h"

namespace baton {

/// A direction with the radiance that comes along it.
struct LightRecord {
  Vec3 direction;  ///< unit
  Rgb radiance;
  float padding[2] = {};  ///< kernels read groups of four
};

/// The shadow rays of some offers.
struct OfferRays {
  ShadowRays rays;
  /// (capacity) whose ray it is; the first rays.size() count.
  std::vector<std::uint32_t> offer;
};

/// The inner loops of the second pass.
namespace kernels {

/// The light along lattice directions.
void look_up_lights(const EnvironmentView& environment, std::span<const OctDirection> code,
                    std::span<LightRecord> lights);

/// What the surfaces of offers make of the lights of their samples; nothing below a horizon.
/// reflected: kReceptionPadding longer than `offers`.
void reflect_lights(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                    std::span<const Offer> offers, std::span<Reflected> reflected);

/// As reflect_lights(), and casts in place of the last rays one for each offer that reflects
/// anything.
void reflect_and_cast(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                      std::span<const Offer> offers, std::span<Reflected> reflected,
                      OfferRays& rays);

}  // namespace kernels
}  // namespace baton
