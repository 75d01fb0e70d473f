#include <algorithm>
#include <utility>
#include <vector>

#include "common/scene/gltf/document_parser.h"

namespace baton::gltf {
namespace {

TextureInfo parse_texture_info(const JsonView& info, const Document& document) {
  TextureInfo read;
  if (!info) return read;
  read.texture = info.required_index("index", document.textures.size());
  read.uv = info.index("texCoord", 2);
  read.strength = info.number("scale", 1, -1e6, 1e6);
  const JsonView transform = info.at("extensions").at("KHR_texture_transform");
  transform.numbers("offset", read.offset);
  transform.numbers("scale", read.scale);
  read.rotation = transform.number("rotation", 0, -1e6, 1e6);
  if (transform.has("texCoord")) read.uv = transform.index("texCoord", 2);
  read.uv = std::max(read.uv, 0);
  return read;
}

void parse_extensions(const JsonView& extensions, const Document& document, Material& material) {
  const double strength =
      extensions.at("KHR_materials_emissive_strength").number("emissiveStrength", 1, 0, 1e6);
  for (double& c : material.emission) c = std::clamp(c, 0.0, 1.0) * strength;
  material.ior = extensions.at("KHR_materials_ior").number("ior", 1.5, 0, 100);
  const JsonView specular = extensions.at("KHR_materials_specular");
  material.specular = specular.number("specularFactor", 1, 0, 1);
  specular.numbers("specularColorFactor", material.specular_color);
  for (double& c : material.specular_color) c = std::clamp(c, 0.0, 1e6);
  material.specular_textured =
      specular.has("specularTexture") || specular.has("specularColorTexture");
  const JsonView coat = extensions.at("KHR_materials_clearcoat");
  material.clearcoat = coat.number("clearcoatFactor", 0, 0, 1);
  material.clearcoat_roughness = coat.number("clearcoatRoughnessFactor", 0, 0, 1);
  material.clearcoat_texture = parse_texture_info(coat.at("clearcoatTexture"), document);
  material.clearcoat_roughness_texture =
      parse_texture_info(coat.at("clearcoatRoughnessTexture"), document);
  material.clearcoat_normal_texture =
      parse_texture_info(coat.at("clearcoatNormalTexture"), document);
}

/// Diffuse, specular and glossiness as a material that is no metal: F0 is the specular colour, and
/// what it reflects is missing below. Of its texture of gloss, which cannot be read, a usual
/// surface is made.
void parse_specular_glossiness(const JsonView& given, const Document& document,
                               Material& material) {
  constexpr double kUsualF0 = 0.04, kUsualRoughness = 0.5;
  std::array<double, 4> diffuse{1, 1, 1, 1};
  std::array<double, 3> specular{1, 1, 1};
  given.numbers("diffuseFactor", diffuse);
  given.numbers("specularFactor", specular);
  double glossiness = given.number("glossinessFactor", 1, 0, 1);
  material.specular_textured = given.has("specularGlossinessTexture");
  if (material.specular_textured) {
    specular = {kUsualF0, kUsualF0, kUsualF0};
    glossiness = 1 - kUsualRoughness;
  }
  for (double& c : specular) c = std::clamp(c, 0.0, 1.0);
  for (std::size_t i = 0; i < 4; ++i) material.base_color[i] = std::clamp(diffuse[i], 0.0, 1.0);
  for (std::size_t i = 0; i < 3; ++i) material.specular_color[i] = specular[i] / kUsualF0;
  material.metallic = 0;
  material.roughness = 1 - glossiness;
  material.base_color_texture = parse_texture_info(given.at("diffuseTexture"), document);
  material.metallic_roughness_texture = {};
  material.is_specular_glossy = true;
}

Material parse_material(const JsonView& material, const Document& document) {
  Material read;
  read.name = material.name("name");
  const JsonView pbr = material.at("pbrMetallicRoughness");
  pbr.numbers("baseColorFactor", read.base_color);
  for (double& c : read.base_color) c = std::clamp(c, 0.0, 1.0);
  read.metallic = pbr.number("metallicFactor", 1, 0, 1);
  read.roughness = pbr.number("roughnessFactor", 1, 0, 1);
  read.base_color_texture = parse_texture_info(pbr.at("baseColorTexture"), document);
  read.metallic_roughness_texture =
      parse_texture_info(pbr.at("metallicRoughnessTexture"), document);
  read.normal_texture = parse_texture_info(material.at("normalTexture"), document);
  read.occluded = material.has("occlusionTexture");

  const std::string mode = material.text("alphaMode");
  if (mode == "MASK") read.alpha_mode = AlphaMode::mask;
  if (mode == "BLEND") read.alpha_mode = AlphaMode::blend;
  read.alpha_cutoff = material.number("alphaCutoff", 0.5, 0, 1e6);
  material.numbers("emissiveFactor", read.emission);
  read.emissive_texture = parse_texture_info(material.at("emissiveTexture"), document);
  parse_extensions(material.at("extensions"), document, read);
  const JsonView glossy = material.at("extensions").at("KHR_materials_pbrSpecularGlossiness");
  // A texture of gloss is not read: what the file has beside it may be what it means.
  if (glossy && !(glossy.has("specularGlossinessTexture") && pbr))
    parse_specular_glossiness(glossy, document, read);
  return read;
}

Wrap wrap_of(std::uint64_t value) {
  if (value == 33071) return Wrap::clamp;
  return value == 33648 ? Wrap::mirror : Wrap::repeat;
}

}  // namespace

void parse_materials(const JsonView& root, Document& document) {
  constexpr std::uint64_t kNearest = 9728;  // as OpenGL counts
  std::vector<Texture> samplers;
  root.each("samplers", [&](const JsonView& sampler) {
    samplers.push_back({.wrap_s = wrap_of(sampler.size("wrapS")),
                        .wrap_t = wrap_of(sampler.size("wrapT")),
                        .nearest = sampler.size("magFilter") == kNearest});
  });
  root.each("textures", [&](const JsonView& texture) {
    const int sampler = texture.index("sampler", samplers.size());
    Texture read = sampler < 0 ? Texture{} : samplers[static_cast<std::size_t>(sampler)];
    const JsonView webp = texture.at("extensions").at("EXT_texture_webp");
    read.image = (webp ? webp : texture).index("source", document.images.size());
    document.textures.push_back(read);
  });
  root.each("materials", [&](const JsonView& material) {
    Fault fault;
    document.materials.push_back(parse_material(material.apart(fault), document));
    document.materials.back().fault = fault.value_or("");
  });
}

}  // namespace baton::gltf
