#include "common/scene/gltf/materials.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <optional>

#include "common/scene/gltf/names.h"

namespace baton::gltf {
namespace {

/// What the schema of jobs takes.
constexpr double kLeastRoughness = 0.02;
constexpr float kMirrorIor = 100;
constexpr const char* kDefaultName = "glTF default";

}  // namespace

std::vector<std::string> material_names(const Document& document) {
  std::vector<std::string> given;
  for (const Material& material : document.materials) given.push_back(material.name);
  std::vector<std::string> names = distinct_names(given, "material", {kDefaultName});
  names.insert(names.begin(), kDefaultName);
  return names;
}

namespace {

/// As a job says it; nothing where there is no image.
std::optional<TextureSpec> texture_spec(const Document& document, const TextureInfo& info) {
  if (info.texture < 0) return std::nullopt;
  const Texture& texture = document.textures[static_cast<std::size_t>(info.texture)];
  if (texture.image < 0) return std::nullopt;
  const Image& image = document.images[static_cast<std::size_t>(texture.image)];
  const auto wrap = [](Wrap given) { return static_cast<TextureWrap>(given); };
  const auto pair = [](const std::array<double, 2>& given) {
    return std::array<float, 2>{static_cast<float>(given[0]), static_cast<float>(given[1])};
  };
  return TextureSpec{.file = image.file.empty() ? document.path : image.file,
                     .image = image.file.empty() ? texture.image : -1,
                     .uv = info.uv,
                     .offset = pair(info.offset),
                     .scale = pair(info.scale),
                     .rotate_deg = static_cast<float>(info.rotation * 180 / std::numbers::pi),
                     .wrap_u = wrap(texture.wrap_s),
                     .wrap_v = wrap(texture.wrap_t),
                     .filter = texture.nearest ? TextureFilter::nearest : TextureFilter::linear,
                     .strength = static_cast<float>(info.strength)};
}

}  // namespace

MaterialSpec plain_material_spec(const Document& document, int material) {
  const Material given =
      material < 0 ? Material{} : document.materials[static_cast<std::size_t>(material)];
  const auto rgb = [](const auto& c) {
    return Rgb{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
  };
  MaterialSpec spec;
  spec.kind = MaterialKind::metallic_roughness;
  spec.base_color = rgb(given.base_color);
  spec.metallic = static_cast<float>(given.metallic);
  spec.roughness = static_cast<float>(std::max(given.roughness, kLeastRoughness));
  // 0 stands for a mirror [KHR_materials_ior].
  spec.ior = given.ior == 0 ? kMirrorIor : static_cast<float>(std::max(given.ior, 1.0));
  spec.specular = static_cast<float>(given.specular);
  spec.specular_color = rgb(given.specular_color);
  if (given.clearcoat > 0) {
    spec.clearcoat = static_cast<float>(given.clearcoat);
    spec.clearcoat_roughness =
        static_cast<float>(std::max(given.clearcoat_roughness, kLeastRoughness));
  }
  spec.emission = rgb(given.emission);
  if (given.alpha_mode != AlphaMode::opaque) spec.alpha = static_cast<float>(given.base_color[3]);
  spec.alpha_blend = given.alpha_mode == AlphaMode::blend;
  if (given.alpha_mode == AlphaMode::mask) {
    // No alpha is above 1.
    if (given.alpha_cutoff > 1) spec.alpha = 0;
    spec.alpha_cutoff = static_cast<float>(std::min(given.alpha_cutoff, 1.0));
  }
  return spec;
}

MaterialSpec material_spec(const Document& document, int material) {
  MaterialSpec spec = plain_material_spec(document, material);
  if (material < 0) return spec;
  const Material& given = document.materials[static_cast<std::size_t>(material)];
  spec.color_texture = texture_spec(document, given.base_color_texture);
  spec.metallic_roughness_texture = texture_spec(document, given.metallic_roughness_texture);
  spec.normal_texture = texture_spec(document, given.normal_texture);
  if (spec.clearcoat) {
    spec.clearcoat_texture = texture_spec(document, given.clearcoat_texture);
    spec.clearcoat_roughness_texture = texture_spec(document, given.clearcoat_roughness_texture);
    spec.clearcoat_normal_texture = texture_spec(document, given.clearcoat_normal_texture);
  }
  if (!(spec.emission == Rgb{}))
    spec.emission_texture = texture_spec(document, given.emissive_texture);
  return spec;
}

std::vector<std::string> unsupported_parts(const Document& document, const Material& material) {
  std::vector<std::string> parts;
  if (material.is_specular_glossy)
    parts.push_back(material.specular_textured
                        ? "its specular and glossiness are a texture, which is not read: 0.04 and "
                          "roughness 0.5 stand for it"
                        : "its specular and glossiness are converted: F0 and 1 - roughness");
  else if (material.specular_textured)
    parts.push_back("its textures of `specular` are not read");
  if (material.occluded)
    parts.push_back("its occlusion texture is not read, as all light is direct");
  for (const TextureInfo* info :
       {&material.base_color_texture, &material.metallic_roughness_texture,
        &material.normal_texture, &material.emissive_texture, &material.clearcoat_texture,
        &material.clearcoat_roughness_texture, &material.clearcoat_normal_texture}) {
    if (info->texture < 0 || document.textures[static_cast<std::size_t>(info->texture)].image >= 0)
      continue;
    parts.push_back("one of its textures has no image of a kind that is read");
    break;
  }
  return parts;
}

}  // namespace baton::gltf
