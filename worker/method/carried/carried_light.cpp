#include "worker/method/carried/carried_light.h"

#include <algorithm>

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/method/carried/carried_light.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "worker/surface/environment-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Notes where directions lie in a map from place i on, and prefetches the texels.
HWY_INLINE void Locate(const EnvironmentView& view, const Vec3Lanes& w, std::size_t i,
                       kernels::LocatedDirections::Place& out) {
  const DF d;
  const TexelLanes at = LocateTexels(view, w);
  PrefetchTexels(view, at);
  hn::Store(at.index, DI(), out.texel.from(i));
  hn::Store(at.fx, d, out.right.from(i));
  hn::Store(at.fy, d, out.down.from(i));
}

void LocateDirections(const EnvironmentView& now, const EnvironmentView* before,
                      std::span<const OctDirection> code, kernels::LocatedDirections& out) {
  const DF d;
  for (std::size_t i = 0; i < code.size(); i += hn::Lanes(d)) {
    HWY_ALIGN std::uint32_t codes[hn::MaxLanes(DU())];
    for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
      codes[lane] = code[std::min(i + lane, code.size() - 1)];
    }
    const Vec3Lanes w = DecodeOctahedral(hn::Load(DU(), codes));
    hn::Store(w.x, d, out.x.from(i));
    hn::Store(w.y, d, out.y.from(i));
    hn::Store(w.z, d, out.z.from(i));
    Locate(now, w, i, out.now);
    if (before != nullptr) Locate(*before, w, i, out.before);
  }
  out.has_before = before != nullptr;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(LocateDirections);

namespace kernels {

void locate_directions(const EnvironmentView& now, const EnvironmentView* before,
                       std::span<const OctDirection> code, LocatedDirections& out) {
  BATON_CHECK(code.size() <= limits::kMaxParticles);
  HWY_DYNAMIC_DISPATCH(LocateDirections)(now, before, code, out);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
