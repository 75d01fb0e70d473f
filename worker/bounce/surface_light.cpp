#include "worker/bounce/surface_light.h"

#include <cmath>

namespace baton {
namespace {

SurfaceCandidate candidate(const Vec3& direction, const Rgb& reflected, const Rgb& radiance,
                           float light_density, float own_density) {
  const float density =
      static_cast<float>(SurfaceLight::kFromLight) * std::abs(light_density) + own_density;
  if (!(density > 0)) return {};
  const Rgb arriving = radiance / density;
  const Rgb value = reflected * arriving;
  return {direction, value, arriving, mean(value)};
}

}  // namespace

void SurfaceLight::add(const SiteBlock& sites, std::size_t i, const PresampledLight::Block& block,
                       const std::array<float, 2>& u) {
  for (std::size_t c = 0; c < kFromLight; ++c) {
    const std::size_t n = from_light_.count;
    radiance_.r[n] = block.r[c];
    radiance_.g[n] = block.g[c];
    radiance_.b[n] = block.b[c];
    density_[n] = block.density[c];
    from_light_.add(i, {block.x[c], block.y[c], block.z[c]});
  }
  if (!(sites.specular_probability[i] > 0)) return;
  place_of_own_[i] = own_.count;
  own_.add(i, u[0], u[1]);
}

void SurfaceLight::evaluate(const SiteBlock& sites, const EnvironmentView& light) {
  from_light_.evaluate(sites);
  if (own_.count == 0) return;
  own_.draw(sites);
  own_.evaluate(sites);
  auto& [x, y, z] = own_.direction;
  kernels::evaluate_environment(light, own_.used(x), own_.used(y), own_.used(z),
                                own_.used(own_radiance_.r), own_.used(own_radiance_.g),
                                own_.used(own_radiance_.b), own_.used(own_density_));
}

SurfaceLight::Candidates SurfaceLight::of(const SiteBlock& sites, std::size_t i) const {
  Candidates all;
  const bool is_glossy = sites.specular_probability[i] > 0;
  for (std::size_t c = 0; c < kFromLight; ++c) {
    const std::size_t n = i * kFromLight + c;
    all[c] = candidate(from_light_.direction[n], from_light_.reflected[n], radiance_[n],
                       density_[n], is_glossy ? from_light_.density[n] : 0);
  }
  if (!is_glossy) return all;
  const std::size_t n = place_of_own_[i];
  all[kFromLight] = candidate(own_.direction[n], own_.reflected[n], own_radiance_[n],
                              own_density_[n], own_.density[n]);
  return all;
}

}  // namespace baton
