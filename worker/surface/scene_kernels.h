#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/math/octahedral.h"
#include "worker/surface/environment_view.h"
#include "worker/surface/site_block.h"

/// Maps and materials for many directions, in SIMD with run-time dispatch.
namespace baton::kernels {

/// Name of the instruction set in use, e.g. "AVX2".
std::string instruction_set();

/// Unit vectors of lattice directions; all spans of one length.
void decode_directions(std::span<const OctDirection> code, std::span<float> x, std::span<float> y,
                       std::span<float> z);

/// Radiance that lights surfaces and table density (1/sr) along unit world directions; all spans of
/// one length.
void evaluate_environment(const EnvironmentView& view, std::span<const float> x,
                          std::span<const float> y, std::span<const float> z, std::span<float> r,
                          std::span<float> g, std::span<float> b, std::span<float> density);

/// Radiance that the camera sees, with what is hidden from surfaces.
void see_environment(const EnvironmentView& view, std::span<const float> x,
                     std::span<const float> y, std::span<const float> z, std::span<float> r,
                     std::span<float> g, std::span<float> b);

/// BRDF times cosine (RGB) and density of sample_bsdf for (site, direction) pairs; all spans of one
/// length.
void evaluate_bsdf(const SiteBlock& sites, std::span<const std::int32_t> site,
                   std::span<const float> x, std::span<const float> y, std::span<const float> z,
                   std::span<float> r, std::span<float> g, std::span<float> b,
                   std::span<float> pdf);

/// Directions drawn from the BRDF for uniforms u0, u1; all spans of one length.
void sample_bsdf(const SiteBlock& sites, std::span<const std::int32_t> site,
                 std::span<const float> u0, std::span<const float> u1, std::span<float> x,
                 std::span<float> y, std::span<float> z);

}  // namespace baton::kernels
