#include "worker/scene/detail_loader.h"

#include <fmt/format.h>

#include <cmath>

#include "common/base/limits.h"

namespace baton {
namespace {

/// "scene.glb, image 3" where a file holds several.
std::string name_of(const TextureSpec& spec) {
  return spec.image < 0 ? spec.file : fmt::format("{}, image {}", spec.file, spec.image);
}

PlacedTexture placed_texture(const TextureSpec& spec, std::shared_ptr<const Texture> texture) {
  const double angle = spec.rotate_deg * (3.14159265358979323846 / 180);
  const auto c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
  return {.texture = std::move(texture),
          .uv_set = static_cast<std::size_t>(spec.uv),
          .linear = {c * spec.scale[0], s * spec.scale[1], -s * spec.scale[0], c * spec.scale[1]},
          .offset = spec.offset,
          .sampling = {.wrap_u = static_cast<Wrap>(spec.wrap_u),
                       .wrap_v = static_cast<Wrap>(spec.wrap_v),
                       .nearest = spec.filter == TextureFilter::nearest}};
}

bool has_detail(const MaterialSpec& spec) {
  return spec.kind != MaterialKind::measured &&
         (!textures_of(spec).empty() || !(spec.emission == Rgb{}) ||
          SurfaceDetail{spec}.is_cut_out());
}

}  // namespace

Result<std::shared_ptr<const SurfaceDetail>> DetailLoader::load(const MaterialSpec& spec) {
  if (!has_detail(spec)) return std::shared_ptr<const SurfaceDetail>();
  auto detail = std::make_shared<SurfaceDetail>();
  detail->spec = spec;
  const TextureUse color = detail->is_cut_out() ? TextureUse::color_and_alpha : TextureUse::color;
  BATON_TRY(place(spec.color_texture, color, detail->color));
  BATON_TRY(place(spec.metallic_roughness_texture, TextureUse::metallic_roughness,
                  detail->metallic_roughness));
  BATON_TRY(place(spec.normal_texture, TextureUse::normal, detail->normal));
  BATON_TRY(place(spec.emission_texture, TextureUse::color, detail->emission));
  BATON_TRY(place(spec.clearcoat_texture, TextureUse::red, detail->clearcoat));
  BATON_TRY(
      place(spec.clearcoat_roughness_texture, TextureUse::green, detail->clearcoat_roughness));
  return std::shared_ptr<const SurfaceDetail>(std::move(detail));
}

Status DetailLoader::place(const std::optional<TextureSpec>& spec, TextureUse use,
                           PlacedTexture& placed) {
  if (!spec) return {};
  const auto key = std::tuple(spec->file, spec->image, use);
  auto found = textures_.find(key);
  if (found == textures_.end()) found = textures_.emplace(key, load_texture(*spec, use)).first;
  if (!found->second) return found->second.error();
  placed = placed_texture(*spec, *found->second);
  return {};
}

Result<DetailLoader::TexturePtr> DetailLoader::load_texture(const TextureSpec& spec,
                                                            TextureUse use) {
  BATON_ASSIGN(const Image image, read(spec));
  BATON_ASSIGN(TexturePtr texture, Texture::build(image, use, name_of(spec)));
  size_bytes_ += texture->size_bytes();
  if (size_bytes_ > limits::kMaxTextureBytes)
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: the scene's textures take more than {} bytes", name_of(spec),
                             limits::kMaxTextureBytes)};
  return texture;
}

Result<Image> DetailLoader::read(const TextureSpec& spec) {
  if (spec.image < 0) return read_image(spec.file);
  BATON_ASSIGN(const auto document, files_.get(spec.file));
  const auto index = static_cast<std::size_t>(spec.image);
  if (index >= document->images.size())
    return document->error(
        fmt::format("expected an image below {}, got {}", document->images.size(), spec.image));
  if (const std::string& file = document->images[index].file; !file.empty())
    return read_image(file);
  return read_image(document->bytes_of_image(index), name_of(spec));
}

std::optional<MissingUvs> missing_uvs(const SurfaceDetail& detail, const TriangleMesh& mesh) {
  const auto missing = [&](const PlacedTexture& texture) {
    return texture.texture != nullptr && mesh.uvs[texture.uv_set].empty();
  };
  if (missing(detail.color)) return MissingUvs{detail.color.uv_set, "colorTexture"};
  if (missing(detail.metallic_roughness))
    return MissingUvs{detail.metallic_roughness.uv_set, "metallicRoughnessTexture"};
  if (missing(detail.normal)) return MissingUvs{detail.normal.uv_set, "normalTexture"};
  if (missing(detail.emission)) return MissingUvs{detail.emission.uv_set, "emissionTexture"};
  if (missing(detail.clearcoat)) return MissingUvs{detail.clearcoat.uv_set, "clearcoatTexture"};
  if (missing(detail.clearcoat_roughness))
    return MissingUvs{detail.clearcoat_roughness.uv_set, "clearcoatRoughnessTexture"};
  return std::nullopt;
}

}  // namespace baton
