#include "worker/exchange/surface_table.h"

#include <algorithm>

namespace baton {

void SurfaceTable::add(const ShadingPoint& point, const Material& material,
                       const Vec3& ray_origin) {
  one_.clear(1);
  one_.add(0, point, material);
  float own_kind = one_.is_ggx[0];
  if (one_.any_measured) {
    const auto found = std::find(tables_.begin(), tables_.end(), one_.measured[0]);
    own_kind = 1 + static_cast<float>(found - tables_.begin());
    if (found == tables_.end()) tables_.push_back(one_.measured[0]);
  }
  const SiteBlock& s = one_;
  common_.push_back({{s.ns_x[0], s.ns_y[0], s.ns_z[0], s.lobe_scale[0],  //
                      s.ng_x[0], s.ng_y[0], s.ng_z[0], own_kind,         //
                      s.kd_r[0], s.kd_g[0], s.kd_b[0], s.shape[0],       //
                      ray_origin.x, ray_origin.y, ray_origin.z, s.ks_r[0]}});
  glossy_.push_back({{s.wo_x[0], s.wo_y[0], s.wo_z[0], s.ks_g[0],  //
                      s.mirror_x[0], s.mirror_y[0], s.mirror_z[0], s.ks_b[0]}});
  if (!s.any_coat && coats_.empty()) return;
  coats_.resize(glossy_.size());  // also of those before the first coat
  if (!s.any_coat) return;
  const SiteBlock::Coats& c = s.coats;
  coats_.back() = {{c.ns_x[0], c.ns_y[0], c.ns_z[0], c.alpha[0],  //
                    c.wo_x[0], c.wo_y[0], c.wo_z[0], c.share[0]}};
}

void SurfaceTable::add_nothing() {
  common_.push_back({});
  glossy_.push_back({});
  if (!coats_.empty()) coats_.push_back({});
}

void SurfaceTable::reserve(std::size_t count) {
  common_.reserve(count);
  glossy_.reserve(count);
}

}  // namespace baton
