#include "worker/surface/texel_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "worker/surface/texel_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Four lanes: u and v of the fine level, then of the coarse one; or four texels; or four channels.
using DF4 = hn::FixedTag<float, 4>;
using DI4 = hn::RebindToSigned<DF4>;
using VF4 = hn::Vec<DF4>;
using VI4 = hn::Vec<DI4>;

/// Texels and their weights, in the order in which they are added.
struct TexelList {
  static constexpr std::size_t kMost = std::size_t{kMostProbes} * 2 * 4;
  std::size_t count = 0;
  alignas(16) std::array<std::int32_t, kMost> texel;
  alignas(16) std::array<float, kMost> weight;
};

/// How coordinates go on along one axis of a footprint. A clamped image ends where its edge does: a
/// footprint whose middle is within it is folded at the edge, and has as much of the edge as the
/// image has; one whose middle is beyond has nothing else. So surfaces that end with the image and
/// those that go on have the right mean of all sites.
struct AxisWrap {
  bool is_below, is_beyond;  ///< all of it lies in the border
  int periods;               ///< images until it repeats; 0: never

  AxisWrap(Wrap wrap, float middle)
      : is_below(wrap == Wrap::clamp && middle < 0),
        is_beyond(wrap == Wrap::clamp && middle > 1),
        periods(is_below || is_beyond  ? 0
                : wrap == Wrap::repeat ? 1
                                       : 2) {}

  /// Of `size` texels the first and the last that count.
  int low(int size) const { return is_below ? -1 : is_beyond ? size : 0; }
  int high(int size) const { return is_below ? -1 : is_beyond ? size : size - 1; }
};

/// How coordinates go on past the edges: lanes of fine u, fine v, coarse u, coarse v.
struct WrapLanes {
  VF4 size;        ///< texels
  VF4 period;      ///< images until it repeats; 0: never
  VF4 per_period;  ///< its inverse; 0: never
  VI4 texels;      ///< texels of a period, or 0
  /// The sum of two texels that mirror each other, or large.
  VI4 mirror;
  /// The first and the last texel, or twice one of the border.
  VI4 low, high;

  WrapLanes(const ProbeLine& line, const TextureSampling& sampling) {
    const auto lanes = [](auto d, auto fine_u, auto fine_v, auto coarse_u, auto coarse_v) HWY_ATTR {
      const hn::TFromD<decltype(d)> values[4] = {fine_u, fine_v, coarse_u, coarse_v};
      return hn::LoadU(d, values);
    };
    const DF4 d;
    const DI4 di;
    const VI4 width =
        lanes(di, line.fine.width, line.fine.height, line.coarse.width, line.coarse.height);
    const AxisWrap u(sampling.wrap_u, line.middle[0]), v(sampling.wrap_v, line.middle[1]);
    const VI4 periods = lanes(di, u.periods, v.periods, u.periods, v.periods);
    const auto inverse = [](int p) { return p == 0 ? 0.0f : 1.0f / static_cast<float>(p); };
    size = hn::ConvertTo(d, width);
    period = hn::ConvertTo(d, periods);
    const float per_u = inverse(u.periods), per_v = inverse(v.periods);
    per_period = lanes(d, per_u, per_v, per_u, per_v);
    texels = hn::Mul(width, periods);
    low = lanes(di, u.low(line.fine.width), v.low(line.fine.height), u.low(line.coarse.width),
                v.low(line.coarse.height));
    high = lanes(di, u.high(line.fine.width), v.high(line.fine.height), u.high(line.coarse.width),
                 v.high(line.coarse.height));
    const auto clamped = hn::Eq(periods, hn::Zero(di));
    const VI4 twice = hn::Sub(hn::Add(width, width), hn::Set(di, 1));
    mirror = hn::IfThenElse(clamped, hn::Set(di, 1 << 20), twice);
  }

  /// Within one period of the image, or at most one image away from it; what is not finite is 0.
  HWY_INLINE VF4 Within(VF4 u) const {
    const DF4 d;
    u = hn::IfThenElseZero(hn::Eq(hn::Sub(u, u), hn::Zero(d)), u);
    u = hn::Sub(u, hn::Mul(period, hn::Floor(hn::Mul(per_period, u))));
    return hn::Min(hn::Max(u, hn::Set(d, -1.0f)), hn::Set(d, 2.0f));
  }
  /// The texel at a place at most one period away.
  HWY_INLINE VI4 Texel(VI4 i) const {
    const VI4 zero = hn::Zero(DI4());
    i = hn::Add(i, hn::IfThenElseZero(hn::Lt(i, zero), texels));
    i = hn::Sub(i, hn::IfThenZeroElse(hn::Lt(i, texels), texels));
    i = hn::Min(i, hn::Sub(mirror, i));
    return hn::Min(hn::Max(i, low), high);
  }
};

/// Appends the four texels around a point of one level. texel: columns of both sides, then rows;
/// weight: theirs.
HWY_INLINE void Append(const TextureLevel& level, VI4 texel, VF4 weight, float share,
                       TexelList& list) {
  const DF4 d;
  const DI4 di;
  const VI4 column = hn::ConcatLowerLower(di, texel, texel);
  const VI4 row = hn::InterleaveUpper(di, texel, texel);
  const VF4 of_column = hn::ConcatLowerLower(d, weight, weight);
  const VF4 of_row = hn::InterleaveUpper(d, weight, weight);
  const VI4 first = hn::Set(di, static_cast<std::int32_t>(level.first));
  const VI4 at = hn::Add(hn::Add(hn::Mul(row, hn::Set(di, level.stride())), column), first);
  hn::StoreU(at, di, list.texel.data() + list.count);
  hn::StoreU(hn::Mul(hn::Mul(hn::Set(d, share), of_row), of_column), d,
             list.weight.data() + list.count);
  list.count += 4;
}

HWY_INLINE void FindTexels(const ProbeLine& line, const TextureSampling& sampling,
                           TexelList& list) {
  const DF4 d;
  const DI4 di;
  const WrapLanes wrap(line, sampling);
  const float one_if_smooth = sampling.nearest && !line.is_smaller ? 0.0f : 1.0f;
  const VF4 half = hn::Set(d, 0.5f * one_if_smooth), smooth = hn::Set(d, one_if_smooth);
  const float share = 1 / static_cast<float>(line.num_probes);
  const auto pair = [](const std::array<float, 2>& uv) HWY_ATTR {
    const float values[4] = {uv[0], uv[1], uv[0], uv[1]};
    return hn::LoadU(DF4(), values);
  };
  const VF4 middle = pair(line.middle), along = pair(line.along);
  for (int p = 0; p < line.num_probes; ++p) {
    const float t = (static_cast<float>(p) + 0.5f) * share - 0.5f;
    const VF4 uv = hn::Add(middle, hn::Mul(hn::Set(d, t), along));
    const VF4 place = hn::Sub(hn::Mul(wrap.Within(uv), wrap.size), half);
    const VF4 low = hn::Floor(place);
    const VF4 high_weight = hn::Mul(hn::Sub(place, low), smooth);
    const VF4 low_weight = hn::Sub(hn::Set(d, 1.0f), high_weight);
    const VI4 i = hn::ConvertTo(di, low);
    const VI4 low_texel = wrap.Texel(i), high_texel = wrap.Texel(hn::Add(i, hn::Set(di, 1)));
    Append(line.fine, hn::InterleaveLower(di, low_texel, high_texel),
           hn::InterleaveLower(d, low_weight, high_weight), share * (1 - line.blend), list);
    if (!(line.blend > 0)) continue;
    Append(line.coarse, hn::InterleaveUpper(di, low_texel, high_texel),
           hn::InterleaveUpper(d, low_weight, high_weight), share * line.blend, list);
  }
}

HWY_INLINE VF4 SumTexels(const TexelList& list, const TexelArray& image) {
  const DF4 d;
  const DI4 di;
  const hn::Rebind<std::uint16_t, DF4> d16;
  const VF4 scale = hn::Set(d, image.scale);
  VF4 sum = hn::Zero(d);
  for (std::size_t i = 0; i < list.count; ++i) {
    const std::size_t first =
        static_cast<std::uint32_t>(list.texel[i]) * std::size_t{image.channels};
    const VF4 value = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(d16, image.values + first)));
    sum = hn::Add(sum, hn::Mul(hn::Set(d, list.weight[i]), hn::Mul(value, scale)));
  }
  return hn::IfThenElseZero(hn::FirstN(d, image.channels), sum);
}

void BlendTexels(const ProbeLine& line, const TextureSampling& sampling,
                 std::span<const TexelArray> images, std::span<std::array<float, 4>> sums) {
  TexelList list;
  FindTexels(line, sampling, list);
  for (std::size_t k = 0; k < images.size(); ++k)
    hn::StoreU(SumTexels(list, images[k]), DF4(), sums[k].data());
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace baton {
HWY_EXPORT(BlendTexels);

namespace kernels {

void blend_texels(const ProbeLine& line, const TextureSampling& sampling,
                  std::span<const TexelArray> images, std::span<std::array<float, 4>> sums) {
  HWY_DYNAMIC_DISPATCH(BlendTexels)(line, sampling, images, sums);
}

}  // namespace kernels
}  // namespace baton
#endif  // HWY_ONCE
