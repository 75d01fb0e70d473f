// The materials in SIMD: material.h for a vector of (site, direction) pairs. Included once per
// Highway target.
#if defined(BATON_WORKER_SCENE_BSDF_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef BATON_WORKER_SCENE_BSDF_INL_H_
#undef BATON_WORKER_SCENE_BSDF_INL_H_
#else
#define BATON_WORKER_SCENE_BSDF_INL_H_
#endif

#include <hwy/highway.h>

#include "common/math/lanes-inl.h"
#include "worker/surface/measured-inl.h"
#include "worker/surface/site_block.h"

HWY_BEFORE_NAMESPACE();
namespace baton::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// A ggx lobe and its viewer.
struct GgxLanes {
  Vec3Lanes ns, wo;
  VF alpha, alpha2, view_cosine, view_masking;  ///< as in SiteBlock
};

/// The surface of each lane's site.
struct SurfaceLanes {
  Vec3Lanes ns, ng, wo, mirror, kd, ks;
  VF shape, lobe_scale, specular_probability;
  VF alpha2, view_cosine, view_masking;  ///< SiteBlock; of a ggx lobe
  MF is_ggx;
  bool any_phong, any_ggx, any_measured;
  /// Any lane has a lobe; if not, only ns, ng and kd matter and the rest is 0.
  bool any_lobe;
  VI site;
  /// Texels of measured BRDFs, some of them null.
  const float* const* tables;
  VI table;       ///< index into `tables`
  bool any_coat;  ///< if not, the coat's lanes are undefined
  GgxLanes coat;
  /// As SiteBlock::Coats has them; 0 where a lane has none.
  VF coat_share, coat_chance;
};

/// table[site] per lane; site in [0, num_sites).
HWY_INLINE VF LookUp(const SiteBlock::Array& table, VI site, int num_sites) {
  const DF d;
  if constexpr (hn::MaxLanes(DF()) == 8) {
    const DI di;
    if (num_sites > 16) return hn::GatherIndex(d, table.data(), site);
    const VF low = hn::TableLookupLanes(hn::Load(d, table.data()),
                                        hn::IndicesFromVec(d, hn::And(site, hn::Set(di, 7))));
    if (num_sites <= 8) return low;
    const VF high = hn::TableLookupLanes(hn::Load(d, table.data() + 8),
                                         hn::IndicesFromVec(d, hn::And(site, hn::Set(di, 7))));
    return hn::IfThenElse(hn::RebindMask(d, hn::Gt(site, hn::Set(di, 7))), high, low);
  } else {
    return hn::GatherIndex(d, table.data(), site);
  }
}

/// Sets what a ggx lobe needs from ns, wo and alpha.
HWY_INLINE void SetViewTerms(GgxLanes& s) {
  const DF d;
  const VF half = hn::Set(d, 0.5f);
  s.alpha2 = hn::Mul(s.alpha, s.alpha);
  s.view_cosine = hn::Max(Dot(s.ns, s.wo), hn::Set(d, kMinCosView));
  const VF c2 = hn::Mul(s.view_cosine, s.view_cosine);
  const VF root = hn::Sqrt(hn::Add(s.alpha2, hn::NegMulAdd(s.alpha2, c2, c2)));
  s.view_masking = hn::MulAdd(half, hn::Div(root, s.view_cosine), half);
}

/// The ggx lobe of a surface that is not the coat's.
HWY_INLINE GgxLanes BaseLobe(const SurfaceLanes& s) {
  return {s.ns, s.wo, s.shape, s.alpha2, s.view_cosine, s.view_masking};
}

template <class Read>
HWY_INLINE SurfaceLanes ReadSurfaces(const SiteBlock& b, VI site, const Read& read) {
  const auto vec = [&](const SiteBlock::Array& x, const SiteBlock::Array& y,
                       const SiteBlock::Array& z) HWY_ATTR {
    return Vec3Lanes{read(x), read(y), read(z)};
  };
  SurfaceLanes s;
  s.ns = vec(b.ns_x, b.ns_y, b.ns_z);
  s.ng = vec(b.ng_x, b.ng_y, b.ng_z);
  s.kd = vec(b.kd_r, b.kd_g, b.kd_b);
  s.any_phong = b.any_phong;
  s.any_ggx = b.any_ggx;
  s.any_measured = b.any_measured;
  s.any_lobe = b.any_phong || b.any_ggx || b.any_measured;
  s.tables = b.measured.data();
  s.site = s.table = site;
  s.any_coat = false;
  if (!s.any_lobe) {
    const VF zero = hn::Zero(DF());
    SetZero(s.wo);
    SetZero(s.mirror);
    SetZero(s.ks);
    s.shape = s.lobe_scale = s.specular_probability = zero;
    s.alpha2 = s.view_cosine = s.view_masking = zero;
    s.is_ggx = hn::Gt(zero, zero);
    return s;
  }
  s.wo = vec(b.wo_x, b.wo_y, b.wo_z);
  s.mirror = vec(b.mirror_x, b.mirror_y, b.mirror_z);
  s.ks = vec(b.ks_r, b.ks_g, b.ks_b);
  s.shape = read(b.shape);
  s.lobe_scale = read(b.lobe_scale);
  s.specular_probability = read(b.specular_probability);
  s.alpha2 = read(b.alpha2);
  s.view_cosine = read(b.view_cosine);
  s.view_masking = read(b.view_masking);
  s.is_ggx = hn::Gt(read(b.is_ggx), hn::Zero(DF()));
  if (!b.any_coat) return s;
  const SiteBlock::Coats& c = b.coats;
  s.any_coat = true;
  s.coat.ns = vec(c.ns_x, c.ns_y, c.ns_z);
  s.coat.wo = vec(c.wo_x, c.wo_y, c.wo_z);
  s.coat.alpha = read(c.alpha);
  SetViewTerms(s.coat);
  s.coat_share = read(c.share);
  s.coat_chance = read(c.chance);
  return s;
}

/// One site for all lanes.
HWY_INLINE SurfaceLanes LoadSurface(const SiteBlock& b, std::size_t site) {
  const VI all = hn::Set(DI(), static_cast<std::int32_t>(site));
  return ReadSurfaces(b, all, [site](const SiteBlock::Array& table) HWY_ATTR {
    return hn::Set(DF(), table[site]);
  });
}

/// A site per lane.
HWY_INLINE SurfaceLanes LoadSurfaces(const SiteBlock& b, VI site) {
  if (b.num_sites == 1) return LoadSurface(b, 0);
  return ReadSurfaces(b, site, [&](const SiteBlock::Array& table) HWY_ATTR {
    return LookUp(table, site, b.num_sites);
  });
}

/// f_c = diffuse * kd_c + lobe * ks_c + white (+ measured_c where there are tables), with the
/// cosine to the shading normal; all 0 below either horizon. coat: where there are coats, theirs,
/// with its own cosine. The densities (1/sr) of sampling by the cosine and by the lobes; lobe_pdf
/// is 0 where there is no lobe.
struct BsdfLanes {
  VF diffuse, lobe, white, cosine, cosine_pdf, lobe_pdf, coat;
  Vec3Lanes measured;
};

/// Density of sample_bsdf: the mixture of both lobes.
HWY_INLINE VF MixturePdf(const SurfaceLanes& s, const BsdfLanes& f) {
  return hn::MulAdd(s.specular_probability, hn::Sub(f.lobe_pdf, f.cosine_pdf), f.cosine_pdf);
}

/// max(a . b, 0)^s of unit vectors, as (1 - |a - b|^2 / 2)^s: sharp lobes keep their digits.
HWY_INLINE VF CosinePower(const Vec3Lanes& a, const Vec3Lanes& b, VF s) {
  const DF d;
  const Vec3Lanes difference{hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
  const VF t = hn::Min(hn::Mul(Dot(difference, difference), hn::Set(d, 0.5f)), hn::Set(d, 1.0f));
  const VF exponent = hn::Mul(s, LogOneMinusLanes(t));
  const MF positive = hn::And(hn::Gt(exponent, hn::Set(d, -80.0f)), hn::Lt(t, hn::Set(d, 1.0f)));
  return hn::IfThenElseZero(positive, ExpLanes(exponent));
}

/// A ggx lobe in directions wi.
struct GgxValues {
  VF dv;   ///< D G2 / (4 n.wi n.wo)
  VF pdf;  ///< D G1(wo) / (4 n.wo)
  VF o_h;  ///< wo . h
};
/// n_wi: ns . wi
HWY_INLINE GgxValues EvaluateGgx(const GgxLanes& s, const Vec3Lanes& wi, VF n_wi) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF one = hn::Set(d, 1.0f);
  // Everything from the half vector times its length l: l^2 = |wi + wo|^2, wo . h = l / 2.
  const Vec3Lanes h = Add(wi, s.wo);
  const VF l2 = hn::Max(Dot(h, h), hn::Set(d, 1e-20f));
  const VF n_h = Dot(s.ns, h);
  const VF o_h = hn::Clamp(hn::Mul(Dot(s.wo, h), hn::Div(one, hn::Sqrt(l2))), zero, one);
  // D [Walter et al. 2007], with the sine from the cross product so that sharp lobes keep their
  // digits.
  const VF cx = hn::MulSub(s.ns.y, h.z, hn::Mul(s.ns.z, h.y));
  const VF cy = hn::MulSub(s.ns.z, h.x, hn::Mul(s.ns.x, h.z));
  const VF cz = hn::MulSub(s.ns.x, h.y, hn::Mul(s.ns.y, h.x));
  const VF sine2 = Dot({cx, cy, cz}, {cx, cy, cz});
  const VF t = hn::MulAdd(hn::Mul(n_h, n_h), s.alpha2, sine2);
  const VF t2 = hn::Max(hn::Mul(t, t), hn::Set(d, 1e-30f));
  // Smith's masking [Heitz 2014]: (1 + Lambda_o + Lambda_i) n.wi without a division.
  const VF c = hn::Clamp(n_wi, hn::Set(d, 1e-6f), one);
  const VF slope = hn::Sqrt(hn::MulAdd(hn::NegMulAdd(c, c, one), s.alpha2, hn::Mul(c, c)));
  const VF masking =
      hn::MulAdd(c, hn::Sub(s.view_masking, hn::Set(d, 0.5f)), hn::Mul(hn::Set(d, 0.5f), slope));
  const VF numerator = hn::IfThenElseZero(
      hn::Gt(n_h, zero), hn::Mul(hn::Mul(l2, l2), hn::Mul(s.alpha2, hn::Set(d, 0.25f * kInvPi))));
  const VF quarter = hn::Div(numerator, hn::Mul(t2, s.view_cosine));
  return {hn::Div(quarter, masking), hn::Div(quarter, s.view_masking), o_h};
}

/// Evaluates BRDF and density of directions wi.
HWY_INLINE BsdfLanes EvaluateBsdf(const SurfaceLanes& s, const Vec3Lanes& wi) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF one = hn::Set(d, 1.0f);
  const VF n_wi = Dot(s.ns, wi);
  const MF above = hn::And(hn::Gt(n_wi, zero), hn::Gt(Dot(s.ng, wi), zero));

  BsdfLanes out;
  out.cosine = hn::IfThenElseZero(above, n_wi);
  out.diffuse = hn::Set(d, kInvPi);
  out.lobe = zero;
  out.white = zero;
  out.cosine_pdf = hn::Mul(hn::Max(n_wi, zero), hn::Set(d, kInvPi));
  out.lobe_pdf = zero;

  if (s.any_phong) {
    const VF power = CosinePower(s.mirror, wi, s.shape);
    out.lobe = hn::Mul(s.lobe_scale, power);
    // (e + 1) / (2 pi), from lobe_scale = (e + 2) / (2 pi).
    out.lobe_pdf = hn::Mul(hn::Max(hn::Sub(s.lobe_scale, hn::Set(d, 0.5f * kInvPi)), zero), power);
  }
  if (s.any_ggx) {
    const GgxValues g = EvaluateGgx(BaseLobe(s), wi, n_wi);
    const VF m = hn::Sub(one, g.o_h);
    const VF m2 = hn::Mul(m, m);
    const VF schlick = hn::Mul(hn::Mul(m2, m2), m);
    const VF keep = hn::Sub(one, schlick);
    const VF kept = hn::NegMulAdd(s.mirror.x, schlick, one);  // F90 = 0: there is no lobe
    out.diffuse = hn::IfThenElse(s.is_ggx, hn::Mul(out.diffuse, kept), out.diffuse);
    out.lobe = hn::IfThenElse(s.is_ggx, hn::Mul(g.dv, keep), out.lobe);
    out.white = hn::IfThenElseZero(s.is_ggx, hn::Mul(hn::Mul(g.dv, schlick), s.lobe_scale));
    out.lobe_pdf = hn::IfThenElse(s.is_ggx, g.pdf, out.lobe_pdf);
  }
  SetZero(out.measured);
  if (s.any_measured) out.measured = EvaluateMeasured(s.tables, s.table, s.ns, wi, s.wo);
  if (!s.any_coat) return out;
  const VF c_wi = Dot(s.coat.ns, wi);
  const GgxValues g = EvaluateGgx(s.coat, wi, c_wi);
  const MF coated = hn::Gt(s.coat_share, zero);
  const MF lit = hn::And(hn::Gt(c_wi, zero), hn::Gt(Dot(s.ng, wi), zero));
  out.white = hn::Mul(out.white, hn::Sub(one, s.coat_share));  // kd and ks are less already
  out.coat = hn::IfThenElseZero(hn::And(coated, lit), hn::Mul(hn::Mul(s.coat_share, c_wi), g.dv));
  out.lobe_pdf = hn::MulAdd(s.coat_chance, hn::Sub(hn::IfThenElseZero(coated, g.pdf), out.lobe_pdf),
                            out.lobe_pdf);
  return out;
}

/// wo mirrored at a visible normal of a ggx lobe, drawn through a spherical cap [Dupuy & Benyoub
/// 2023]. u: uniform in [0, 1); sine, cosine: of a uniform angle.
HWY_INLINE Vec3Lanes SampleGgx(const GgxLanes& s, VF u, VF sine, VF cosine) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF one = hn::Set(d, 1.0f);
  const Vec3Lanes wo = FrameToLocal(s.ns, s.wo);
  const VF oz = hn::Max(wo.z, hn::Set(d, 1e-4f));
  const Vec3Lanes stretched{hn::Mul(wo.x, s.alpha), hn::Mul(wo.y, s.alpha), oz};
  const Vec3Lanes o = Scale(stretched, InverseSqrt(Dot(stretched, stretched)));
  const VF z = hn::Sub(hn::Mul(hn::Sub(one, u), hn::Add(one, o.z)), o.z);
  const VF r = hn::Sqrt(hn::Clamp(hn::NegMulAdd(z, z, one), zero, one));
  const Vec3Lanes cap = Add({hn::Mul(r, cosine), hn::Mul(r, sine), z}, o);
  const Vec3Lanes normal{hn::Mul(cap.x, s.alpha), hn::Mul(cap.y, s.alpha),
                         hn::Max(cap.z, hn::Set(d, 1e-6f))};
  const Vec3Lanes h = FrameToWorld(s.ns, Scale(normal, InverseSqrt(Dot(normal, normal))));
  const VF twice = hn::Mul(hn::Set(d, 2.0f), Dot(h, s.wo));
  return {hn::MulSub(h.x, twice, s.wo.x), hn::MulSub(h.y, twice, s.wo.y),
          hn::MulSub(h.z, twice, s.wo.z)};
}

/// A direction around the surface per lane: from the lobe with `specular_probability`, else from
/// the cosine. u0, u1 uniform in [0, 1).
HWY_INLINE Vec3Lanes SampleBsdf(const SurfaceLanes& s, VF specular_probability, VF u0, VF u1) {
  const DF d;
  const VF zero = hn::Zero(d);
  const VF one = hn::Set(d, 1.0f);
  // One stretch of u0 chooses the lobe, the position within it samples the lobe: well spread points
  // stay so.
  const MF specular = hn::Lt(u0, specular_probability);
  const VF below = hn::Div(u0, hn::Max(specular_probability, hn::Set(d, 1e-20f)));
  const VF over = hn::Div(hn::Sub(u0, specular_probability),
                          hn::Max(hn::Sub(one, specular_probability), hn::Set(d, 1e-20f)));
  VF u = hn::Clamp(hn::IfThenElse(specular, below, over), zero, hn::Set(d, 0x1.fffffep-1f));
  MF coated = hn::Gt(zero, zero);
  if (s.any_coat) {  // the same once more, of what the lobes have
    coated = hn::And(specular, hn::Lt(u, s.coat_chance));
    const VF in_coat = hn::Div(u, hn::Max(s.coat_chance, hn::Set(d, 1e-20f)));
    const VF beside = hn::Div(hn::Sub(u, s.coat_chance),
                              hn::Max(hn::Sub(one, s.coat_chance), hn::Set(d, 1e-20f)));
    const VF within =
        hn::Clamp(hn::IfThenElse(coated, in_coat, beside), zero, hn::Set(d, 0x1.fffffep-1f));
    u = hn::IfThenElse(specular, within, u);
  }
  VF sine, cosine;
  SinCosTurns(u1, sine, cosine);

  // Cosine lobe about ns: z = sqrt(1 - u).
  const VF radius = hn::Sqrt(u);
  const VF height = hn::Sqrt(hn::Sub(one, u));
  Vec3Lanes w = FrameToWorld(s.ns, {hn::Mul(radius, cosine), hn::Mul(radius, sine), height});

  if (s.any_phong && !hn::AllFalse(d, specular)) {
    const VF z = ExpLanes(
        hn::Div(LogLanes(hn::Max(hn::Sub(one, u), hn::Set(d, 1e-30f))), hn::Add(s.shape, one)));
    const VF r = hn::Sqrt(hn::Max(hn::NegMulAdd(z, z, one), zero));
    w = Select(specular, FrameToWorld(s.mirror, {hn::Mul(r, cosine), hn::Mul(r, sine), z}), w);
  }
  if (s.any_ggx && !hn::AllFalse(d, specular)) {
    w = Select(hn::And(specular, s.is_ggx), SampleGgx(BaseLobe(s), u, sine, cosine), w);
  }
  if (s.any_coat) w = Select(coated, SampleGgx(s.coat, u, sine, cosine), w);
  return w;
}

/// Reflected radiance (f cos L) per channel. A lane's value is the same to the bit whatever
/// surfaces the other lanes see: which those are depends, in the second pass, on the tiling.
HWY_INLINE Vec3Lanes ReflectedRadiance(const SurfaceLanes& s, const BsdfLanes& f, VF r, VF g,
                                       VF b) {
  if (!s.any_lobe) {
    // What is left of the general case without a lobe, in the same order.
    const auto diffuse = [&](VF kd, VF radiance) HWY_ATTR {
      return hn::Mul(hn::Mul(hn::Mul(hn::Set(DF(), kInvPi), kd), f.cosine), radiance);
    };
    return {diffuse(s.kd.x, r), diffuse(s.kd.y, g), diffuse(s.kd.z, b)};
  }
  const auto channel = [&](VF kd, VF ks, VF radiance) HWY_ATTR {
    return hn::Mul(hn::Mul(hn::MulAdd(f.diffuse, kd, hn::MulAdd(f.lobe, ks, f.white)), f.cosine),
                   radiance);
  };
  const Vec3Lanes reflected{channel(s.kd.x, s.ks.x, r), channel(s.kd.y, s.ks.y, g),
                            channel(s.kd.z, s.ks.z, b)};
  if (!s.any_measured && !s.any_coat) return reflected;
  const auto tabulated = [&](VF value, VF radiance)
                             HWY_ATTR { return hn::Mul(hn::Mul(value, f.cosine), radiance); };
  Vec3Lanes sum = reflected;
  if (s.any_measured) {
    sum = Add(sum,
              {tabulated(f.measured.x, r), tabulated(f.measured.y, g), tabulated(f.measured.z, b)});
  }
  return s.any_coat ? AddScaled({r, g, b}, f.coat, sum) : sum;
}

}  // namespace baton::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
