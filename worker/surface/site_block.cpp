#include "worker/surface/site_block.h"

#include <algorithm>

#include "common/base/check.h"
#include "worker/surface/ggx_energy.h"

namespace baton {

void SiteBlock::clear(int sites) {
  BATON_CHECK(sites >= 1 && sites <= kMaxSites);
  num_sites = sites;
  num_hits = 0;
  num_lobes = 0;
  specular_sum = 0;
  any_phong = false;
  any_ggx = false;
  any_measured = false;
  any_coat = false;
}

namespace {

/// All that a site has, without its coat.
constexpr SiteBlock::Array SiteBlock::*kOfSite[] = {
    &SiteBlock::ns_x,     &SiteBlock::ns_y,        &SiteBlock::ns_z,
    &SiteBlock::ng_x,     &SiteBlock::ng_y,        &SiteBlock::ng_z,
    &SiteBlock::wo_x,     &SiteBlock::wo_y,        &SiteBlock::wo_z,
    &SiteBlock::mirror_x, &SiteBlock::mirror_y,    &SiteBlock::mirror_z,
    &SiteBlock::kd_r,     &SiteBlock::kd_g,        &SiteBlock::kd_b,
    &SiteBlock::ks_r,     &SiteBlock::ks_g,        &SiteBlock::ks_b,
    &SiteBlock::shape,    &SiteBlock::lobe_scale,  &SiteBlock::specular_probability,
    &SiteBlock::alpha2,   &SiteBlock::view_cosine, &SiteBlock::view_masking,
    &SiteBlock::is_ggx};
constexpr SiteBlock::Array SiteBlock::Coats::*kOfCoat[] = {
    &SiteBlock::Coats::ns_x,  &SiteBlock::Coats::ns_y,  &SiteBlock::Coats::ns_z,
    &SiteBlock::Coats::wo_x,  &SiteBlock::Coats::wo_y,  &SiteBlock::Coats::wo_z,
    &SiteBlock::Coats::alpha, &SiteBlock::Coats::share, &SiteBlock::Coats::chance};

}  // namespace

void SiteBlock::Coats::clear(int sites) {
  for (const auto array : kOfCoat) std::fill_n((this->*array).begin(), sites, 0.0f);
}

void SiteBlock::add_miss(int site) {
  const auto s = static_cast<std::size_t>(site);
  for (const auto array : kOfSite) (this->*array)[s] = 0;
  measured[s] = nullptr;
}

void SiteBlock::add_copy(int site, const SiteBlock& from, int other) {
  BATON_CHECK(site >= 0 && site < num_sites && num_hits < kMaxSites);
  const auto s = static_cast<std::size_t>(site), o = static_cast<std::size_t>(other);
  for (const auto array : kOfSite) (this->*array)[s] = (from.*array)[o];
  measured[s] = from.measured[o];
  any_phong = any_phong || from.any_phong;
  any_ggx = any_ggx || from.any_ggx;
  any_measured = any_measured || from.any_measured;
  if (from.any_coat) {
    if (!any_coat) coats.clear(num_sites);
    any_coat = true;
    for (const auto array : kOfCoat) (coats.*array)[s] = (from.coats.*array)[o];
  }
  specular_sum += specular_probability[s];
  hit_sites[static_cast<std::size_t>(num_hits++)] = site;
  if (specular_probability[s] > 0) lobe_sites[static_cast<std::size_t>(num_lobes++)] = site;
}

void SiteBlock::add(int site, const ShadingPoint& point, const Material& material) {
  BATON_CHECK(site >= 0 && site < num_sites && num_hits < kMaxSites);
  const auto s = static_cast<std::size_t>(site);
  const auto set = [s](Array& x, Array& y, Array& z, const Vec3& v) {
    x[s] = v.x;
    y[s] = v.y;
    z[s] = v.z;
  };
  const bool tabulated = material.lobe == Material::Lobe::measured;
  const bool ggx = material.lobe == Material::Lobe::ggx || tabulated;
  const bool phong = material.lobe == Material::Lobe::phong;

  set(ns_x, ns_y, ns_z, point.ns);
  set(ng_x, ng_y, ng_z, point.ng);
  const Vec3 wo = ggx ? clamped_view(point) : point.wo;
  set(wo_x, wo_y, wo_z, wo);
  set(mirror_x, mirror_y, mirror_z,
      ggx ? Vec3{material.dielectric_f90, 0, 0} : reflect(wo, point.ns));
  const float cos_view = ggx ? std::max(dot(point.ns, wo), kMinCosView) : 1.0f;
  set(kd_r, kd_g, kd_b,
      ggx ? material.kd * (Rgb{1, 1, 1} - material.dielectric_f0) * diffuse_left(material, cos_view)
          : material.kd);
  set(ks_r, ks_g, ks_b, ggx || phong ? material.ks : Rgb{});
  shape[s] = material.shape;
  lobe_scale[s] =
      phong ? (material.shape + 2) * (0.5f * kInvPi) : (ggx && !tabulated ? material.f90 : 0.0f);
  specular_probability[s] = ggx || phong ? material.specular_probability : 0.0f;
  is_ggx[s] = ggx ? 1.0f : 0.0f;
  alpha2[s] = ggx ? material.shape * material.shape : 0.0f;
  view_cosine[s] = cos_view;
  view_masking[s] = ggx ? ggx_view_masking(view_cosine[s], material.shape) : 1.0f;
  measured[s] = tabulated ? material.table->texels() : nullptr;

  any_phong = any_phong || phong;
  any_ggx = any_ggx || ggx;
  any_measured = any_measured || tabulated;
  if (material.coat.weight > 0) add_coat(s, point, material);
  specular_sum += specular_probability[s];
  hit_sites[static_cast<std::size_t>(num_hits++)] = site;
  if (specular_probability[s] > 0) lobe_sites[static_cast<std::size_t>(num_lobes++)] = site;
}

void SiteBlock::add_coat(std::size_t site, const ShadingPoint& point, const Material& material) {
  if (!any_coat) coats.clear(num_sites);
  any_coat = true;
  const SeenCoat seen = see_coat(material, point);
  const LobeChances chance = lobe_chances(material, seen.share);
  coats.ns_x[site] = seen.point.ns.x;
  coats.ns_y[site] = seen.point.ns.y;
  coats.ns_z[site] = seen.point.ns.z;
  coats.wo_x[site] = seen.point.wo.x;
  coats.wo_y[site] = seen.point.wo.y;
  coats.wo_z[site] = seen.point.wo.z;
  coats.alpha[site] = material.coat.alpha;
  coats.share[site] = seen.share;
  coats.chance[site] = chance.coat;
  specular_probability[site] = chance.any;
  for (Array* const below : {&kd_r, &kd_g, &kd_b, &ks_r, &ks_g, &ks_b})
    (*below)[site] *= 1 - seen.share;
}

}  // namespace baton
