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

/// How coordinates go on past the edges: lanes of fine u, fine v, coarse u, coarse v.
struct WrapLanes {
  VF4 size;        ///< texels
  VF4 period;      ///< images until it repeats; 0: never
  VF4 per_period;  ///< its inverse; 0: never
  VI4 texels;      ///< texels of a period, or 0
  /// The sum of two texels that mirror each other, or large.
  VI4 mirror;
  /// The first and the last texel, or those of the border.
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
    const auto of = [&](Wrap wrap) {
      return wrap == Wrap::repeat ? 1 : wrap == Wrap::mirror ? 2 : 0;
    };
    const int border_u = sampling.wrap_u == Wrap::clamp ? 1 : 0;
    const int border_v = sampling.wrap_v == Wrap::clamp ? 1 : 0;
    const VI4 border = lanes(di, border_u, border_v, border_u, border_v);
    const int u = of(sampling.wrap_u), v = of(sampling.wrap_v);
    const VI4 periods = lanes(di, u, v, u, v);
    const auto inverse = [](int p) { return p == 0 ? 0.0f : 1.0f / static_cast<float>(p); };
    size = hn::ConvertTo(d, width);
    period = hn::ConvertTo(d, periods);
    per_period = lanes(d, inverse(u), inverse(v), inverse(u), inverse(v));
    texels = hn::Mul(width, periods);
    const VI4 one = hn::Set(di, 1), last = hn::Sub(width, one);
    const auto clamped = hn::Eq(periods, hn::Zero(di));
    low = hn::Neg(border);
    high = hn::Add(last, border);
    mirror = hn::IfThenElse(clamped, hn::Set(di, 1 << 20), hn::Add(width, last));
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
