#include "worker/scene/gltf/materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace baton::gltf {
namespace {

/// What the schema of jobs takes.
constexpr double kLeastRoughness = 0.02;

}  // namespace

std::vector<std::string> material_names(const Document& document) {
  std::vector<std::string> names{"glTF default"};
  std::set<std::string> taken{names.front()};
  for (std::size_t m = 0; m < document.materials.size(); ++m) {
    const std::string& given = document.materials[m].name;
    std::string name = given.empty() ? fmt::format("material {}", m) : given;
    while (!taken.insert(name).second) name = fmt::format("{} ({})", name, m);
    names.push_back(name);
  }
  return names;
}

MaterialSpec material_spec(const Document& document, int material) {
  const Material given =
      material < 0 ? Material{} : document.materials[static_cast<std::size_t>(material)];
  const auto color = [&](std::size_t c) { return static_cast<float>(given.base_color[c]); };
  MaterialSpec spec;
  spec.kind = MaterialKind::metallic_roughness;
  spec.base_color = {color(0), color(1), color(2)};
  spec.metallic = static_cast<float>(given.metallic);
  spec.roughness = static_cast<float>(std::max(given.roughness, kLeastRoughness));
  return spec;
}

std::vector<std::string> unsupported_parts(const Material& material) {
  std::vector<std::string> parts;
  if (material.emissive) parts.push_back("it does not glow: emission is not read");
  if (material.alpha_mode != AlphaMode::opaque)
    parts.push_back("it is opaque: its alpha is not read");
  for (const TextureInfo* texture :
       {&material.base_color_texture, &material.metallic_roughness_texture,
        &material.normal_texture}) {
    if (texture->texture < 0) continue;
    parts.push_back("its textures are not read");
    break;
  }
  return parts;
}

}  // namespace baton::gltf
