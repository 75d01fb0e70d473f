#include <algorithm>
#include <tuple>
#include <utility>

#include "worker/scene/gltf/document_parser.h"

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

Material parse_material(const JsonView& material, const Document& document) {
  Material read;
  read.name = material.text("name");
  const JsonView pbr = material.at("pbrMetallicRoughness");
  pbr.numbers("baseColorFactor", read.base_color);
  for (double& c : read.base_color) c = std::clamp(c, 0.0, 1.0);
  read.metallic = pbr.number("metallicFactor", 1, 0, 1);
  read.roughness = pbr.number("roughnessFactor", 1, 0, 1);
  read.base_color_texture = parse_texture_info(pbr.at("baseColorTexture"), document);
  read.metallic_roughness_texture =
      parse_texture_info(pbr.at("metallicRoughnessTexture"), document);
  read.normal_texture = parse_texture_info(material.at("normalTexture"), document);

  const std::string mode = material.text("alphaMode");
  if (mode == "MASK") read.alpha_mode = AlphaMode::mask;
  if (mode == "BLEND") read.alpha_mode = AlphaMode::blend;
  read.alpha_cutoff = material.number("alphaCutoff", 0.5, 0, 1e6);
  std::array<double, 3> light{};
  material.numbers("emissiveFactor", light);
  read.emissive = light != std::array<double, 3>{};
  return read;
}

Wrap wrap_of(std::uint64_t value) {
  if (value == 33071) return Wrap::clamp;
  return value == 33648 ? Wrap::mirror : Wrap::repeat;
}

}  // namespace

void parse_materials(const JsonView& root, Document& document) {
  std::vector<std::pair<Wrap, Wrap>> samplers;
  root.each("samplers", [&](const JsonView& sampler) {
    samplers.emplace_back(wrap_of(sampler.size("wrapS")), wrap_of(sampler.size("wrapT")));
  });
  root.each("textures", [&](const JsonView& texture) {
    Texture read;
    read.image = texture.index("source", document.images.size());
    if (const int s = texture.index("sampler", samplers.size()); s >= 0)
      std::tie(read.wrap_s, read.wrap_t) = samplers[static_cast<std::size_t>(s)];
    document.textures.push_back(read);
  });
  root.each("materials", [&](const JsonView& material) {
    document.materials.push_back(parse_material(material, document));
  });
}

}  // namespace baton::gltf
