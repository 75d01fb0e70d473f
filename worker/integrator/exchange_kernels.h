#pragma once

#include <cstdint>
#include <span>

#include "common/math/octahedral.h"
#include "worker/integrator/surface_table.h"
#include "worker/sampling/reflected.h"
#include "worker/scene/environment_view.h"

namespace baton {

/// A direction with the radiance that comes along it.
struct LightRecord {
  Vec3 direction;  ///< unit
  Rgb radiance;
  float padding[2] = {};  ///< kernels read groups of four
};

/// Which light falls on which surface: positions in a table and among records.
struct LitSurface {
  std::int32_t surface = 0;
  std::int32_t light = 0;
};

/// The inner loops of the second pass.
namespace kernels {

/// The light along lattice directions.
void look_up_lights(const EnvironmentView& environment, std::span<const OctDirection> code,
                    std::span<LightRecord> lights);

/// What surfaces make of lights; nothing below a horizon. reflected: kPadding longer than `pairs`
/// (worker/integrator/kernels.h).
void reflect_lights(const SurfaceTable& surfaces, std::span<const LightRecord> lights,
                    std::span<const LitSurface> pairs, std::span<Reflected> reflected);

}  // namespace kernels
}  // namespace baton
