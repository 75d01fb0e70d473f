#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "worker/scene/scene.h"
#include "worker/scene/texture_tiles.h"
#include "worker/texture/texture.h"

namespace baton {

/// A texture and where it lies on a surface.
struct PlacedTexture {
  std::shared_ptr<const Texture> texture;     ///< null: none; of tiles the first
  std::shared_ptr<const TextureTiles> tiles;  ///< null: it is one image
  std::size_t uv_set = 0;
  /// Image place of texture coordinates c: offset + linear c.
  std::array<float, 4> linear{1, 0, 0, 1};  ///< row by row
  std::array<float, 2> offset{0, 0};
  TextureSampling sampling{};

  /// Whether both are at the same place everywhere.
  bool lies_as(const PlacedTexture& other) const {
    return uv_set == other.uv_set && linear == other.linear && offset == other.offset &&
           sampling == other.sampling && (tiles == nullptr) == (other.tiles == nullptr);
  }
  /// linear uv.
  Uv turned(const Uv& uv) const {
    return {linear[0] * uv[0] + linear[1] * uv[1], linear[2] * uv[0] + linear[3] * uv[1]};
  }
  /// A triangle of the mesh, which has the coordinates, in the plane of tiles.
  TileTriangle triangle(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& corner) const;
};

/// The textures of a material.
enum class DetailImage : std::uint8_t {
  color,
  metallic_roughness,
  normal,
  emission,
  clearcoat,
  clearcoat_roughness,
  clearcoat_normal,
};
inline constexpr std::size_t kNumDetailImages = 7;

struct NamedTexture {
  const char* name;
  const PlacedTexture* placed;
};

/// What a material of numbers has beside them.
struct SurfaceDetail {
  MaterialSpec spec;  ///< the numbers: factors of the textures
  std::array<PlacedTexture, kNumDetailImages> images{};
  /// Those of them that a look is for, in groups that lie alike on a surface.
  std::vector<std::vector<DetailImage>> alike{};

  const PlacedTexture& operator[](DetailImage image) const {
    return images[static_cast<std::size_t>(image)];
  }
  bool has(DetailImage image) const { return (*this)[image].texture != nullptr; }
  /// Those that are there, with their names in a job.
  std::vector<NamedTexture> textures() const;
  /// Not every ray that meets the surface stops there.
  bool is_cut_out() const { return spec.alpha_cutoff > 0 || spec.alpha_blend; }
};

/// Where on a mesh a surface was hit.
struct SurfacePlace {
  std::uint32_t triangle = 0;
  float u = 0, v = 0;  ///< barycentric coordinates of its second and third corner
  float width = 0;     ///< of what the site sees, across the ray, in the world

  bool operator==(const SurfacePlace&) const = default;
};

/// A surface as it is lit: with its normal and its material as its textures say.
struct SeenSurface {
  ShadingPoint point;
  Material material;
  Rgb emission{};  ///< radiance to the viewer
};

/// A catcher of shadows (worker/pass/catcher.h): it blocks nothing, so light that comes from below
/// its triangle but from above the shading normal's horizon arrives, too, and without objects the
/// share is 1.
inline SeenSurface as_catcher(ShadingPoint point, const Rgb& albedo) {
  point.ng = point.ns;
  return {.point = point, .material = {.kd = albedo, .ks = {}}};
}

/// What detail makes of a surface, without the place: it is kept for as long as the place is.
struct SurfaceLook {
  Vec3 ns{};  ///< shading normal
  Rgb kd{}, ks{}, emission{};
  float shape = 1, specular_probability = 0, f90 = 1;
  Material::Lobe lobe = Material::Lobe::none;
  Coat coat{};

  static SurfaceLook of(const SeenSurface& seen);
  /// At the place where it was seen.
  SeenSurface at(const ShadingPoint& point) const;
};

/// The surface at a hit of `instance`, whose material has detail. point: with the normals of the
/// mesh. A mapped normal is bent just so far towards the geometric one that the viewer's mirror
/// image lies above the surface. Textures are averaged over the width of the place, which the
/// surface's slope stretches. shapes: of the frame.
SeenSurface see_detail(const Scene& scene, const Instance& instance, const SurfacePlace& place,
                       const ShadingPoint& point, const MeshShapes& shapes = {});

/// Whether a ray passes the instance, whose material is cut out, at that place: its alpha, blended
/// in the image of full size, is below the cut-off, or where the surface blends below `draw`. A
/// ray's draw, uniform in (0, 1], differs from surface to surface: the share 1 - alpha of all rays
/// passes, and each wholly or not at all.
bool is_cut_away(const Scene& scene, const Instance& instance, const SurfacePlace& place,
                 float draw);

/// `normal`, turned towards ng until wo's mirror image about it is above the surface: as shallow as
/// 0.01, or as nine tenths of wo. All unit; dot(ng, wo) >= 0.
Vec3 bent_normal(const Vec3& normal, const Vec3& ng, const Vec3& wo);

}  // namespace baton
