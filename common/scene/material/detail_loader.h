#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "common/scene/gltf/file_cache.h"
#include "common/scene/material/surface_detail.h"

namespace baton {

/// Whether a material has a SurfaceDetail.
bool has_detail(const MaterialSpec& spec);

/// Loads the textures of materials, each image once for each use.
class DetailLoader {
 public:
  /// files: must outlive the object. listed: the tiles of textures are among them. max_bytes: that
  /// all textures together may take.
  DetailLoader(gltf::FileCache& files, const std::vector<FileSpec>& listed,
               std::uint64_t max_bytes);

  /// What a material of numbers has beside them; null: nothing. Errors name the file: no image,
  /// not there, together larger than max_bytes, or one while it is read.
  Result<std::shared_ptr<const SurfaceDetail>> load(const MaterialSpec& spec);

 private:
  using TexturePtr = std::shared_ptr<const Texture>;
  Status place(const std::optional<TextureSpec>& spec, TextureUse use, PlacedTexture& placed);
  Result<TexturePtr> texture_of(const TextureSpec& spec, TextureUse use);
  Result<std::shared_ptr<const TextureTiles>> tiles_of(const TextureSpec& spec, TextureUse use);
  Result<TexturePtr> load_texture(const TextureSpec& spec, TextureUse use);
  Result<Image> read(const TextureSpec& spec);

  gltf::FileCache& files_;
  std::set<std::string> listed_;
  std::map<std::tuple<std::string, int, TextureUse>, Result<TexturePtr>> textures_;
  const std::uint64_t max_bytes_;
  std::uint64_t size_bytes_ = 0;
  std::set<std::string> notes_;  ///< of images of the material that is loaded
};

/// A set of texture coordinates that a texture of the material needs and the mesh does not have;
/// nullopt: none. name: of the texture, as in a job.
struct MissingUvs {
  std::size_t set;
  const char* texture;
};
std::optional<MissingUvs> missing_uvs(const SurfaceDetail& detail, const TriangleMesh& mesh);

/// What a texture of tiles lacks on a mesh that has the coordinates: "colorTexture needs
/// skin.1002.png, which is missing"; nullopt: nothing.
std::optional<std::string> missing_tiles(const SurfaceDetail& detail, const TriangleMesh& mesh);

}  // namespace baton
