#include "worker/surface/seen_surface.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "worker/surface/texture_lookup.h"

namespace baton {
namespace {

/// Cosines of slopes below this count as this: footprints end.
constexpr float kLeastSlope = 0.01f;
/// Least cosine between a mapped and the geometric normal.
constexpr float kLeastUpright = 0.02f;
/// Alphas that differ by less are one: half a step of those in memory.
constexpr float kAlphaStep = 0.5f / 65535;

template <class T>
T mix(const T& a, const T& b, const T& c, float u, float v) {
  return a * (1 - u - v) + b * u + c * v;
}

Uv mix_uv(const Uv& a, const Uv& b, const Uv& c, float u, float v) {
  return {mix(a[0], b[0], c[0], u, v), mix(a[1], b[1], c[1], u, v)};
}

/// What the images of a material say at a place. Of those that it does not have, nothing is there.
struct DetailTexels {
  std::array<std::array<float, 4>, kNumDetailImages> means;

  std::array<float, 4>& operator[](DetailImage i) { return means[static_cast<std::size_t>(i)]; }
  const std::array<float, 4>& operator[](DetailImage i) const {
    return means[static_cast<std::size_t>(i)];
  }
};

/// The triangle at a place, in the world.
class Patch {
 public:
  Patch(const Scene& scene, const Instance& instance, const SurfacePlace& place,
        const MeshShapes& shapes)
      : mesh_(scene.meshes[instance.mesh]),
        vertices_(vertices_of(scene, shapes, instance.mesh)),
        instance_(instance),
        place_(place),
        corner_(mesh_.triangles[place.triangle]) {}

  /// Sets what the site sees: a rectangle, longer along the view by its slope. Without, look-ups
  /// are those of a point.
  void set_footprint(const ShadingPoint& point) {
    const Vec3 a = world(0);
    edge_b_ = world(1) - a;
    edge_c_ = world(2) - a;
    bb_ = dot(edge_b_, edge_b_);
    bc_ = dot(edge_b_, edge_c_);
    cc_ = dot(edge_c_, edge_c_);
    const float slope = std::max(dot(point.ng, point.wo), kLeastSlope);
    const Vec3 down = point.wo - point.ng * dot(point.ng, point.wo);
    const Vec3 along = length(down) > 1e-6f ? normalize(down) : Frame(point.ng).x;
    along_ = on_triangle(along * (place_.width / slope));
    across_ = on_triangle(cross(point.ng, along) * place_.width);
  }

  /// All images of a material.
  DetailTexels texels_of(const SurfaceDetail& detail) const {
    DetailTexels texels;
    for (const std::vector<DetailImage>& alike : detail.alike) {
      const Place at = find(detail[alike.front()]);
      std::array<const Texture*, kNumDetailImages> images;
      std::array<std::array<float, 4>, kNumDetailImages> means;
      for (std::size_t i = 0; i < alike.size(); ++i) images[i] = image_at(detail[alike[i]], at);
      look_up_together(std::span(images).first(alike.size()), at.uv, at.seen, at.sampling, means);
      for (std::size_t i = 0; i < alike.size(); ++i) texels[alike[i]] = means[i];
    }
    return texels;
  }
  /// 1 where the image has no alpha.
  float alpha(const PlacedTexture& t) const {
    const Place at = find(t);
    const Texture& image = *image_at(t, at);
    return image.has_alpha() ? look_up(image, at.uv, at.seen, at.sampling)[3] : 1;
  }

  /// Factor of base colour and alpha, of a mesh that has such.
  VertexColor color() const {
    const std::vector<VertexColor>& of = mesh_.colors;
    const VertexColor &a = of[corner_[0]], &b = of[corner_[1]], &c = of[corner_[2]];
    VertexColor blend{};
    for (std::size_t i = 0; i < blend.size(); ++i)
      blend[i] = mix(a[i], b[i], c[i], place_.u, place_.v);
    return blend;
  }
  bool has_color() const { return !mesh_.colors.empty(); }

  /// The normal that (x, y, z) of tangent space is, z along that of the mesh; unit, on the side of
  /// ns.
  Vec3 from_tangent_space(const Vec3& local, const Vec3& ns) const {
    const std::span<const Tangent> t = vertices_.tangents;
    const float u = place_.u, v = place_.v;
    const Vec3 normal = own_normal();
    Vec3 tangent =
        mix(t[corner_[0]].direction, t[corner_[1]].direction, t[corner_[2]].direction, u, v);
    tangent = normalize(tangent - normal * dot(normal, tangent));
    const Vec3 up = cross(normal, tangent) * t[corner_[0]].side;
    const Vec3 n = normalize(instance_.normal_to_world * normal);
    const Vec3 world = normalize(instance_.to_world.linear * tangent) * local.x +
                       normalize(instance_.to_world.linear * up) * local.y + n * local.z;
    return normalize(dot(n, ns) < 0 ? -world : world);
  }

 private:
  Vec3 world(std::size_t k) const {
    return instance_.to_world.point(vertices_.positions[corner_[k]]);
  }

  /// The interpolated normal in the space of the mesh.
  Vec3 own_normal() const {
    const auto corner = [&](std::span<const Vec3> values, std::size_t k) {
      return values[corner_[k]];
    };
    const auto [positions, normals, tangents] = vertices_;
    if (normals.empty()) {
      const Vec3 a = corner(positions, 0);
      return normalize(cross(corner(positions, 1) - a, corner(positions, 2) - a));
    }
    return normalize(
        mix(corner(normals, 0), corner(normals, 1), corner(normals, 2), place_.u, place_.v));
  }

  /// Where textures that lie alike are looked up.
  struct Place {
    Uv uv;
    Footprint seen;
    TextureSampling sampling;
    std::optional<std::size_t> tile{};  ///< index of the tile, where it is one
  };
  Place find(const PlacedTexture& t) const {
    const std::vector<Uv>& uvs = mesh_.uvs[t.uv_set];
    const Uv &a = uvs[corner_[0]], &b = uvs[corner_[1]], &c = uvs[corner_[2]];
    const Uv at = t.turned(mix_uv(a, b, c, place_.u, place_.v));
    const Uv to_b = t.turned({b[0] - a[0], b[1] - a[1]});
    const Uv to_c = t.turned({c[0] - a[0], c[1] - a[1]});
    const auto edge = [&](const Uv& step) -> Uv {
      return {step[0] * to_b[0] + step[1] * to_c[0], step[0] * to_b[1] + step[1] * to_c[1]};
    };
    const Footprint seen{edge(along_), edge(across_)};
    const Uv uv{at[0] + t.offset[0], at[1] + t.offset[1]};
    if (t.tiles == nullptr) return {uv, seen, t.sampling};
    // Each tile ends at its edges.
    const TilePlace place = tile_place(t.triangle(mesh_, corner_), {uv[0], 1 - uv[1]});
    return {place.uv, seen, t.sampling,
            place.is_in_range() ? std::optional(place.index()) : std::nullopt};
  }
  /// Where rounding leads to a tile that no triangle needs, the first stands for it.
  static const Texture* image_at(const PlacedTexture& t, const Place& at) {
    const Texture* const tile = at.tile ? t.tiles->images[*at.tile].get() : nullptr;
    return tile != nullptr ? tile : t.texture.get();
  }

  /// A step in the world, in edges of the triangle.
  Uv on_triangle(const Vec3& step) const {
    const float sb = dot(step, edge_b_), sc = dot(step, edge_c_);
    const float determinant = bb_ * cc_ - bc_ * bc_;
    if (!(determinant > 0)) return {0, 0};
    return {(cc_ * sb - bc_ * sc) / determinant, (bb_ * sc - bc_ * sb) / determinant};
  }

  const TriangleMesh& mesh_;
  const MeshVertices vertices_;
  const Instance& instance_;
  const SurfacePlace& place_;
  const std::array<std::uint32_t, 3>& corner_;
  Vec3 edge_b_{}, edge_c_{};
  float bb_ = 0, bc_ = 0, cc_ = 0;  ///< dot products of the two edges
  /// Sides of the footprint, in edges of the triangle.
  Uv along_{}, across_{};
};

/// The shading normal that a normal map's texel gives. strength: of the map. has_lobe: what it
/// shades mirrors.
Vec3 mapped_normal(const Patch& patch, const std::array<float, 4>& texel, float strength,
                   const ShadingPoint& point, bool has_lobe) {
  const Vec3 local{(2 * texel[0] - 1) * strength, (2 * texel[1] - 1) * strength, 2 * texel[2] - 1};
  if (!(length(local) > 0)) return point.ns;
  Vec3 normal = patch.from_tangent_space(local, point.ns);
  if (const float upright = dot(normal, point.ng); upright < kLeastUpright)
    normal = normalize(normal + point.ng * (kLeastUpright - upright));
  return has_lobe ? bent_normal(normal, point.ng, point.wo) : normal;
}

/// What textures say of a coat, whose normal is that of the mesh or of a map of its own; what is
/// below glows through it.
void see_coat_detail(const Patch& patch, const SurfaceDetail& detail, const DetailTexels& texels,
                     const ShadingPoint& point, SeenSurface& seen) {
  Coat& coat = seen.material.coat;
  coat.normal = point.ns;
  if (detail.has(DetailImage::clearcoat_normal))
    coat.normal = mapped_normal(patch, texels[DetailImage::clearcoat_normal],
                                detail.spec.clearcoat_normal_texture->strength, point, true);
  if (detail.has(DetailImage::clearcoat))
    coat.weight = std::min(coat.weight * texels[DetailImage::clearcoat][0], 1.0f);
  if (detail.has(DetailImage::clearcoat_roughness)) {
    const float given = detail.spec.clearcoat_roughness.value_or(kLeastRoughness);
    const float roughness =
        std::clamp(given * texels[DetailImage::clearcoat_roughness][0], kLeastRoughness, 1.0f);
    coat.alpha = roughness * roughness;
  }
  seen.emission = seen.emission * (1 - see_coat(seen.material, seen.point).share);
}

}  // namespace

SeenSurface see_detail(const Scene& scene, const Instance& instance, const SurfacePlace& place,
                       const ShadingPoint& point, const MeshShapes& shapes) {
  const SurfaceDetail& detail = *scene.material_of(instance).detail;
  Patch patch(scene, instance, place, shapes);
  patch.set_footprint(point);
  const MaterialSpec& spec = detail.spec;
  Rgb color = spec.base_color, emission = spec.emission;
  float metallic = spec.metallic, roughness = spec.roughness;
  const DetailTexels texels = patch.texels_of(detail);
  const auto rgb = [&](DetailImage image) {
    return Rgb{texels[image][0], texels[image][1], texels[image][2]};
  };
  if (detail.has(DetailImage::color)) {
    color = color * rgb(DetailImage::color);
    color = {std::min(color.x, 1.0f), std::min(color.y, 1.0f), std::min(color.z, 1.0f)};
  }
  if (patch.has_color()) {
    const VertexColor factor = patch.color();
    color = color * Rgb{factor[0], factor[1], factor[2]};
  }
  if (detail.has(DetailImage::metallic_roughness)) {
    const std::array<float, 4>& t = texels[DetailImage::metallic_roughness];
    roughness = std::clamp(roughness * t[0], kLeastRoughness, 1.0f);
    metallic = std::min(metallic * t[1], 1.0f);
  }
  if (detail.has(DetailImage::emission)) emission = emission * rgb(DetailImage::emission);
  SeenSurface seen{point, make_material(spec, color, metallic, roughness), emission};
  if (detail.has(DetailImage::normal))
    seen.point.ns = mapped_normal(patch, texels[DetailImage::normal], spec.normal_texture->strength,
                                  point, seen.material.lobe != Material::Lobe::none);
  if (seen.material.coat.weight > 0) see_coat_detail(patch, detail, texels, point, seen);
  return seen;
}

SurfaceShading SurfaceShading::of(const SeenSurface& seen) {
  const Material& m = seen.material;
  return {.ns = seen.point.ns,
          .kd = m.kd,
          .ks = m.ks,
          .emission = seen.emission,
          .shape = m.shape,
          .specular_probability = m.specular_probability,
          .f90 = m.f90,
          .metallic = m.metallic,
          .lobe = m.lobe,
          .coat = m.coat};
}

SeenSurface SurfaceShading::at(const ShadingPoint& point, const Material& material) const {
  SeenSurface seen{point,
                   {.lobe = lobe,
                    .kd = kd,
                    .ks = ks,
                    .shape = shape,
                    .specular_probability = specular_probability,
                    .f90 = f90,
                    .dielectric_f0 = material.dielectric_f0,
                    .dielectric_f90 = material.dielectric_f90,
                    .metallic = metallic,
                    .coat = coat},
                   emission};
  seen.point.ns = ns;
  return seen;
}

bool is_cut_away(const Scene& scene, const Instance& instance, const SurfacePlace& place,
                 float draw) {
  const SurfaceDetail& detail = *scene.material_of(instance).detail;
  const Patch patch(scene, instance, place, {});
  float alpha = detail.spec.alpha;
  if (detail.has(DetailImage::color)) alpha *= patch.alpha(detail[DetailImage::color]);
  if (patch.has_color()) alpha *= patch.color()[3];
  const float cutoff = detail.spec.alpha_cutoff;
  return alpha < std::max(cutoff - std::min(kAlphaStep, 0.5f * cutoff),
                          detail.spec.alpha_blend ? draw : 0.0f);
}

// With N' = x X + z ng in the plane of both normals, the mirror image's height
// 2 (x I.X + z I.ng) z - I.ng shall be t. Squared, that is quadratic in z^2.
Vec3 bent_normal(const Vec3& normal, const Vec3& ng, const Vec3& wo) {
  const float height = dot(wo, ng);
  const float threshold = std::min(0.9f * height, 0.01f);
  if (dot(ng, reflect(wo, normal)) >= threshold) return normal;
  const Vec3 aside = normal - ng * dot(normal, ng);
  if (!(length(aside) > 0)) return ng;
  const Vec3 x = normalize(aside);
  // In doubles: at grazing view the root is of a small difference.
  const double sideways = dot(wo, x), up = height, t = threshold;
  const double a = sideways * sideways + up * up;
  if (!(a > 0)) return ng;
  const double b = a + up * t, c = (t + up) * (t + up);
  const double root = std::sqrt(std::max(b * b - a * c, 0.0));
  const double z2 = std::clamp(0.5 * (sideways < 0 ? b + root : b - root) / a, 0.0, 1.0);
  return normalize(x * static_cast<float>(std::sqrt(1 - z2)) +
                   ng * static_cast<float>(std::sqrt(z2)));
}

}  // namespace baton
