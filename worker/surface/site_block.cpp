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

void SiteBlock::Coats::clear(int sites) {
  for (Array* const array : {&ns_x, &ns_y, &ns_z, &wo_x, &wo_y, &wo_z, &alpha, &share, &chance})
    std::fill_n(array->begin(), sites, 0.0f);
}

void SiteBlock::add_miss(int site) {
  const auto s = static_cast<std::size_t>(site);
  for (Array* array : {&ns_x,     &ns_y,        &ns_z,
                       &ng_x,     &ng_y,        &ng_z,
                       &wo_x,     &wo_y,        &wo_z,
                       &mirror_x, &mirror_y,    &mirror_z,
                       &kd_r,     &kd_g,        &kd_b,
                       &ks_r,     &ks_g,        &ks_b,
                       &shape,    &lobe_scale,  &specular_probability,
                       &alpha2,   &view_cosine, &view_masking,
                       &is_ggx}) {
    (*array)[s] = 0;
  }
  measured[s] = nullptr;
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
