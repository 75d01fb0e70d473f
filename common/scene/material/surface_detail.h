#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "common/job/job_spec.h"
#include "common/scene/material/texture_tiles.h"
#include "common/scene/mesh/triangle_mesh.h"
#include "common/scene/texture/texture.h"

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
  /// What its images' files say, each with the name of the file.
  std::vector<std::string> notes{};

  const PlacedTexture& operator[](DetailImage image) const {
    return images[static_cast<std::size_t>(image)];
  }
  bool has(DetailImage image) const { return (*this)[image].texture != nullptr; }
  /// Those that are there, with their names in a job.
  std::vector<NamedTexture> textures() const;
  /// Not every ray that meets the surface stops there.
  bool is_cut_out() const { return spec.alpha_cutoff > 0 || spec.alpha_blend; }
};

}  // namespace baton
