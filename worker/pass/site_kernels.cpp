#include "worker/pass/site_kernels.h"

#include "common/base/check.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/pass/site_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "common/math/exact_lanes-inl.h"
#include "common/math/philox-inl.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Writes what belongs to the even and the odd sites of pairs: of a vector whose blocks are pairs
/// 0, 1, then 2, 3, ..., in turn (PairsFrom).
HWY_INLINE void StoreInTurn(VF even, VF odd, float* to) {
  const DF d;
  hn::StoreU(hn::InterleaveLower(d, even, odd), d, to);
  hn::StoreU(hn::InterleaveUpper(d, even, odd), d, to + hn::Lanes(d));
}
/// The pairs of two vectors of sites, as interleaving blocks puts them in order.
HWY_INLINE VU PairsFrom(std::uint32_t first) {
  static constexpr std::uint32_t kOfFour[] = {0, 1, 2, 3}, kOfEight[] = {0, 1, 4, 5, 2, 3, 6, 7};
  const DU du;
  return hn::Add(hn::Set(du, first), hn::LoadU(du, hn::MaxLanes(du) == 4 ? kOfFour : kOfEight));
}

void PlaceSites(const kernels::SiteCells& cells, const Rng& rng,
                const std::array<std::uint32_t, 2>& shift, std::span<float> x, std::span<float> y) {
  const DF d;
  const DU du;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t i = 0; i < cells.x.size(); i += 2 * lanes) {
    const auto bits = PhiloxBlock(du, rng, 0, PairsFrom(static_cast<std::uint32_t>(i / 2)));
    const auto uniform = [&](VU word, std::size_t axis) HWY_ATTR {
      return UniformLanes(d, hn::Xor(word, hn::Set(du, shift[axis])));
    };
    StoreInTurn(uniform(bits.w0, 0), uniform(bits.w2, 0), &x[i]);
    StoreInTurn(uniform(bits.w1, 1), uniform(bits.w3, 1), &y[i]);
  }
  const VF width = hn::Set(d, cells.width);
  for (std::size_t i = 0; i < cells.x.size(); i += lanes) {
    hn::StoreU(hn::Mul(hn::Add(LoadSome(cells.x, i), hn::LoadU(d, &x[i])), width), d, &x[i]);
    hn::StoreU(hn::Mul(hn::Add(LoadSome(cells.y, i), hn::LoadU(d, &y[i])), width), d, &y[i]);
  }
}

/// Rays as records of six floats.
HWY_INLINE void StoreRays(const Vec3Lanes& origin, const Vec3Lanes& direction, Ray* rays) {
  const FourRows first = TransposeBlocks(origin.x, origin.y, origin.z, direction.x);
  const FourRows last = TransposeBlocks(origin.z, direction.x, direction.y, direction.z);
  for (std::size_t k = 0; k < 4; ++k) {
    const auto store = [&](VF row, std::size_t field) HWY_ATTR {
      StoreBlocks(DF(), row, [&](std::size_t block) {
        return reinterpret_cast<float*>(rays + 4 * block + k) + field;
      });
    };
    store(first.row[k], 0);
    store(last.row[k], 2);
  }
}

void CameraRays(const ImagePlane& plane, const std::array<float, 2>& pixel,
                std::span<const float> x, std::span<const float> y, std::span<Ray> rays) {
  static_assert(sizeof(Ray) == 6 * sizeof(float));
  const DF d;
  const std::size_t lanes = hn::Lanes(d);
  const Vec3Lanes eye = SetLanes(plane.eye), forward = SetLanes(plane.forward);
  for (std::size_t i = 0; i < rays.size(); i += lanes) {
    const VF px = hn::Add(hn::Set(d, pixel[0]), hn::LoadU(d, &x[i]));
    const VF py = hn::Add(hn::Set(d, pixel[1]), hn::LoadU(d, &y[i]));
    const Vec3Lanes ahead = Add(Add(SetLanes(plane.corner), Scale(SetLanes(plane.right), px)),
                                Scale(SetLanes(plane.down), py));
    const Vec3Lanes origin = plane.is_orthographic ? Add(eye, Sub(ahead, forward)) : eye;
    const Vec3Lanes direction = plane.is_orthographic ? forward : ExactNormalize(ahead);
    if (i + lanes <= rays.size()) {
      StoreRays(origin, direction, &rays[i]);
    } else {
      std::array<Ray, hn::MaxLanes(DF())> some;
      StoreRays(origin, direction, some.data());
      std::copy_n(some.begin(), rays.size() - i, rays.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(PlaceSites);
HWY_EXPORT(CameraRays);

namespace kernels {

void place_sites(const SiteCells& cells, const Rng& rng, const std::array<std::uint32_t, 2>& shift,
                 std::span<float> x, std::span<float> y) {
  BATON_CHECK(x.size() >= cells.x.size() + 16 && y.size() >= cells.x.size() + 16);
  HWY_DYNAMIC_DISPATCH(PlaceSites)(cells, rng, shift, x, y);
}

void camera_rays(const ImagePlane& plane, const std::array<float, 2>& pixel,
                 std::span<const float> x, std::span<const float> y, std::span<Ray> rays) {
  BATON_CHECK(x.size() >= rays.size() + 8 && y.size() >= rays.size() + 8);
  HWY_DYNAMIC_DISPATCH(CameraRays)(plane, pixel, x, y, rays);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
