#include "common/scene/material/surface_detail.h"

namespace baton {

TileTriangle PlacedTexture::triangle(const TriangleMesh& mesh,
                                     const std::array<std::uint32_t, 3>& corner) const {
  TileTriangle places;
  for (std::size_t k = 0; k < 3; ++k) {
    const Uv at = turned(mesh.uvs[uv_set][corner[k]]);
    places[k] = {at[0] + offset[0], 1 - (at[1] + offset[1])};
  }
  return places;
}

std::vector<NamedTexture> SurfaceDetail::textures() const {
  std::vector<NamedTexture> there;
  constexpr std::array<const char*, kNumDetailImages> kNames{
      "colorTexture",     "metallicRoughnessTexture",  "normalTexture",         "emissionTexture",
      "clearcoatTexture", "clearcoatRoughnessTexture", "clearcoatNormalTexture"};
  for (std::size_t i = 0; i < kNumDetailImages; ++i) {
    if (images[i].texture != nullptr) there.push_back({kNames[i], &images[i]});
  }
  return there;
}

}  // namespace baton
