#include "common/scene/material/detail_loader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/limits.h"
#include "common/job/udim.h"
#include "common/scene/texture/image_colors.h"

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
          .tiles = {},
          .uv_set = static_cast<std::size_t>(spec.uv),
          .linear = {c * spec.scale[0], s * spec.scale[1], -s * spec.scale[0], c * spec.scale[1]},
          .offset = spec.offset,
          .sampling = {.wrap_u = static_cast<Wrap>(spec.wrap_u),
                       .wrap_v = static_cast<Wrap>(spec.wrap_v),
                       .nearest = spec.filter == TextureFilter::nearest}};
}

/// The images that are there, in the order of DetailImage, in groups that lie alike.
std::vector<std::vector<DetailImage>> groups_of(const SurfaceDetail& detail) {
  std::vector<std::vector<DetailImage>> groups;
  for (std::size_t i = 0; i < kNumDetailImages; ++i) {
    const auto image = static_cast<DetailImage>(i);
    if (!detail.has(image)) continue;
    const auto group = std::ranges::find_if(groups, [&](const std::vector<DetailImage>& others) {
      return detail[others.front()].lies_as(detail[image]);
    });
    if (group != groups.end()) {
      group->push_back(image);
    } else {
      groups.push_back({image});
    }
  }
  return groups;
}

}  // namespace

bool has_detail(const MaterialSpec& spec) {
  return spec.kind != MaterialKind::measured &&
         (!textures_of(spec).empty() || !(spec.emission == Rgb{}) ||
          SurfaceDetail{spec}.is_cut_out());
}

DetailLoader::DetailLoader(gltf::FileCache& files, const std::vector<FileSpec>& listed,
                           std::uint64_t max_bytes)
    : files_(files), max_bytes_(std::min(max_bytes, limits::kMaxTextureBytes)) {
  for (const FileSpec& file : listed) listed_.insert(file.path);
}

Result<std::shared_ptr<const SurfaceDetail>> DetailLoader::load(const MaterialSpec& spec) {
  if (!has_detail(spec)) return std::shared_ptr<const SurfaceDetail>();
  auto detail = std::make_shared<SurfaceDetail>();
  detail->spec = spec;
  const TextureUse color = detail->is_cut_out() ? TextureUse::color_and_alpha : TextureUse::color;
  const struct {
    DetailImage image;
    const std::optional<TextureSpec>& texture;
    TextureUse use;
  } images[] = {
      {DetailImage::color, spec.color_texture, color},
      {DetailImage::metallic_roughness, spec.metallic_roughness_texture,
       TextureUse::metallic_roughness},
      {DetailImage::normal, spec.normal_texture, TextureUse::normal},
      {DetailImage::emission, spec.emission_texture, TextureUse::light},
      {DetailImage::clearcoat, spec.clearcoat_texture, TextureUse::red},
      {DetailImage::clearcoat_roughness, spec.clearcoat_roughness_texture, TextureUse::green},
      {DetailImage::clearcoat_normal, spec.clearcoat_normal_texture, TextureUse::normal},
  };
  for (const auto& [image, texture, use] : images)
    BATON_TRY(place(texture, use, detail->images[static_cast<std::size_t>(image)]));
  detail->alike = groups_of(*detail);
  detail->notes.assign(notes_.begin(), notes_.end());
  notes_.clear();
  return std::shared_ptr<const SurfaceDetail>(std::move(detail));
}

Status DetailLoader::place(const std::optional<TextureSpec>& spec, TextureUse use,
                           PlacedTexture& placed) {
  if (!spec) return {};
  if (!has_tiles(spec->file)) {
    BATON_ASSIGN(TexturePtr texture, texture_of(*spec, use));
    placed = placed_texture(*spec, std::move(texture));
    return {};
  }
  BATON_ASSIGN(auto tiles, tiles_of(*spec, use));
  const auto first =
      std::ranges::find_if(tiles->images, [](const auto& t) { return t != nullptr; });
  placed = placed_texture(*spec, *first);
  // What lies beyond a tile is another: footprints are folded at its edges.
  placed.sampling.wrap_u = placed.sampling.wrap_v = Wrap::mirror;
  placed.tiles = std::move(tiles);
  return {};
}

/// From those that are there, or loaded.
Result<DetailLoader::TexturePtr> DetailLoader::texture_of(const TextureSpec& spec, TextureUse use) {
  const auto key = std::tuple(spec.file, spec.image, use);
  auto found = textures_.find(key);
  if (found == textures_.end()) found = textures_.emplace(key, load_texture(spec, use)).first;
  return found->second;
}

/// At least one.
Result<std::shared_ptr<const TextureTiles>> DetailLoader::tiles_of(const TextureSpec& spec,
                                                                   TextureUse use) {
  auto tiles = std::make_shared<TextureTiles>();
  tiles->file = spec.file;
  bool any = false;
  for (int i = 0; i < kNumTiles; ++i) {
    TextureSpec tile = spec;
    tile.file = tile_file(spec.file, kFirstTile + i);
    if (!listed_.contains(tile.file)) continue;
    BATON_ASSIGN(tiles->images[static_cast<std::size_t>(i)], texture_of(tile, use));
    any = true;
  }
  if (!any)
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: none of the tiles {} to {} is there", spec.file, kFirstTile,
                             kFirstTile + kNumTiles - 1)};
  return std::shared_ptr<const TextureTiles>(std::move(tiles));
}

Result<DetailLoader::TexturePtr> DetailLoader::load_texture(const TextureSpec& spec,
                                                            TextureUse use) {
  BATON_ASSIGN(Image image, read(spec));
  for (const std::string& note : image.notes)
    notes_.insert(fmt::format("{}: {}", name_of(spec), note));
  BATON_TRY(to_linear_colors(image, use, name_of(spec)));
  BATON_ASSIGN(TexturePtr texture, Texture::build(image, use, name_of(spec)));
  for (const std::string& note : repair_notes(texture->repairs()))
    notes_.insert(fmt::format("{}: {}", name_of(spec), note));
  size_bytes_ += texture->size_bytes();
  if (size_bytes_ > max_bytes_)
    return Error{ErrorKind::bad_input, fmt::format("{}: the scene's textures take more than {} MiB",
                                                   name_of(spec), max_bytes_ >> 20)};
  return texture;
}

Result<Image> DetailLoader::read(const TextureSpec& spec) {
  // Floats of four channels, until it is a texture.
  const PixelLimit limit{static_cast<std::int64_t>(max_bytes_ / (4 * sizeof(float))),
                         fmt::format(", since textures may take {} MiB", max_bytes_ >> 20)};
  if (spec.image < 0) return read_image(spec.file, limit);
  BATON_ASSIGN(const auto document, files_.get(spec.file));
  const auto index = static_cast<std::size_t>(spec.image);
  if (index >= document->images.size())
    return document->error(
        fmt::format("expected an image below {}, got {}", document->images.size(), spec.image));
  if (const std::string& file = document->images[index].file; !file.empty()) {
    if (files_.listed() != nullptr && !files_.listed()->contains(file))
      return gltf::not_listed(spec.file, file);
    return read_image(file, limit);
  }
  return read_image(document->bytes_of_image(index), name_of(spec), limit);
}

std::optional<MissingUvs> missing_uvs(const SurfaceDetail& detail, const TriangleMesh& mesh) {
  for (const auto& [name, placed] : detail.textures()) {
    if (mesh.uvs[placed->uv_set].empty()) return MissingUvs{placed->uv_set, name};
  }
  return std::nullopt;
}

std::optional<std::string> missing_tiles(const SurfaceDetail& detail, const TriangleMesh& mesh) {
  for (const auto& [name, placed] : detail.textures()) {
    if (placed->tiles == nullptr) continue;
    for (const auto& corner : mesh.triangles) {
      if (const auto fault = tile_fault(*placed->tiles, placed->triangle(mesh, corner)))
        return fmt::format("{} {}", name, *fault);
    }
  }
  return std::nullopt;
}

}  // namespace baton
