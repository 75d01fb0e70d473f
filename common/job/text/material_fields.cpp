#include <fmt/format.h>

#include "common/base/limits.h"
#include "common/job/text/job_fields.h"
#include "common/job/udim.h"

namespace baton {
namespace {

/// Two numbers; one stands for both.
void pair(JobArchive& a, Key key, std::array<float, 2>& value, NumberRange range, bool lone) {
  std::array<double, 2> numbers{decimal(value[0]), decimal(value[1])};
  if (!a.numbers(key, numbers, range, lone)) return;
  value = {static_cast<float>(numbers[0]), static_cast<float>(numbers[1])};
}

/// What a file name with <UDIM> must and must not have beside it.
void check_tiles(JobArchive& a, const TextureSpec& texture) {
  const std::string& file = texture.file;
  const std::size_t at = file.find(kTileMark);
  if (at == std::string::npos) return;
  const bool is_lone = file.find(kTileMark, at + 1) == std::string::npos;
  if (is_gltf(file) || !is_lone || file.find('/', at) != std::string::npos)
    a.fault("file", fmt::format("{} at most once, in the name of an image", kTileMark),
            fmt::format("\"{}\"", file));
  if (texture.wrap_u != TextureWrap::repeat || texture.wrap_v != TextureWrap::repeat)
    a.fault("wrapU",
            fmt::format("no wrapU and wrapV beside {}, whose tiles end at their edges", kTileMark),
            std::string(kTextureWraps.at(static_cast<std::size_t>(
                texture.wrap_u != TextureWrap::repeat ? texture.wrap_u : texture.wrap_v))));
}

void fields(JobArchive& a, TextureSpec& texture, bool is_normal_map) {
  asset_path(a, required("file"), texture.file,
             {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".exr", ".hdr", ".tga", ".bmp", ".webp",
              ".gltf", ".glb"});
  a.integer("image", texture.image, -1, limits::kMaxGltfIndex);
  if (!texture.file.empty() && is_gltf(texture.file) != (texture.image >= 0))
    a.fault("image", "the place of an image if file is .gltf or .glb, else -1",
            std::to_string(texture.image));
  a.integer("uv", texture.uv, 0, 1);
  pair(a, "offset", texture.offset, kCoordinateRange, false);
  pair(a, "scale", texture.scale, kCoordinateRange, true);
  a.number("rotateDeg", texture.rotate_deg, kAngleRange);
  a.choice("wrapU", texture.wrap_u, kTextureWraps);
  a.choice("wrapV", texture.wrap_v, kTextureWraps);
  a.choice("filter", texture.filter, kTextureFilters);
  check_tiles(a, texture);
  if (is_normal_map) a.number("strength", texture.strength, kCoordinateRange);
}

void texture_field(JobArchive& a, Key key, std::optional<TextureSpec>& texture,
                   bool is_normal_map = false) {
  TextureSpec read = texture.value_or(TextureSpec{});
  if (a.object(key, [&] { fields(a, read, is_normal_map); },
               {.shorthand = "file", .present = texture.has_value()}))
    texture = read;
}

/// What all materials have that are given by numbers.
void surface_fields(JobArchive& a, MaterialSpec& material) {
  texture_field(a, "colorTexture", material.color_texture);
  texture_field(a, "normalTexture", material.normal_texture, true);
  a.vector("emission", material.emission, kLightRange);
  texture_field(a, "emissionTexture", material.emission_texture);
  a.number("alpha", material.alpha, kUnitRange);
  a.number("alphaCutoff", material.alpha_cutoff, kUnitRange);
  a.boolean("alphaBlend", material.alpha_blend);
}

/// Material: may be const.
template <class Material>
auto given_textures(Material& material) {
  std::vector<decltype(&*material.color_texture)> textures;
  for (auto* texture :
       {&material.color_texture, &material.metallic_roughness_texture, &material.normal_texture,
        &material.emission_texture, &material.clearcoat_texture,
        &material.clearcoat_roughness_texture, &material.clearcoat_normal_texture}) {
    if (texture->has_value()) textures.push_back(&**texture);
  }
  return textures;
}

}  // namespace

void fields(JobArchive& a, MaterialSpec& material) {
  a.choice(required("type"), material.kind, kMaterialKinds);
  if (material.kind != MaterialKind::measured) {
    a.vector("color", material.base_color, kUnitRange);
    surface_fields(a, material);
  }
  switch (material.kind) {
    case MaterialKind::diffuse:
      break;
    case MaterialKind::phong:
      a.vector("specularColor", material.specular_color, kUnitRange);
      a.number("kd", material.kd, kUnitRange);
      a.number("ks", material.ks, kUnitRange);
      a.number("exponent", material.exponent, {1, 100000});
      // Float sums such as 0.7 + 0.3 may be an ulp above 1.
      if (material.kd + material.ks > 1.000001f) {
        a.fault("ks", "kd + ks <= 1, or the material makes light",
                fmt::format("{}", material.kd + material.ks));
      }
      break;
    case MaterialKind::metallic_roughness:
      a.number("metallic", material.metallic, kUnitRange);
      a.number("roughness", material.roughness, {0.02, 1});
      texture_field(a, "metallicRoughnessTexture", material.metallic_roughness_texture);
      a.number("ior", material.ior, {1, 100});
      a.number("specular", material.specular, kUnitRange);
      a.vector("specularColor", material.specular_color, kLightRange);
      a.number("clearcoat", material.clearcoat, kUnitRange);
      texture_field(a, "clearcoatTexture", material.clearcoat_texture);
      if (material.clearcoat_texture && !material.clearcoat)
        a.fault("clearcoatTexture", "clearcoat beside it, whose factor it is", "none");
      a.number("clearcoatRoughness", material.clearcoat_roughness, {0.02, 1});
      texture_field(a, "clearcoatRoughnessTexture", material.clearcoat_roughness_texture);
      texture_field(a, "clearcoatNormalTexture", material.clearcoat_normal_texture, true);
      break;
    case MaterialKind::measured:
      asset_path(a, required("file"), material.file, {".binary"});
      break;
  }
}

std::vector<TextureSpec*> textures_of(MaterialSpec& material) { return given_textures(material); }

std::vector<const TextureSpec*> textures_of(const MaterialSpec& material) {
  return given_textures(material);
}

}  // namespace baton
