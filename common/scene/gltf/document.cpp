#include "common/scene/gltf/document.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "common/base/file_stamp.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/job/text/job_json_text.h"
#include "common/scene/gltf/compression.h"
#include "common/scene/gltf/container.h"
#include "common/scene/gltf/document_parser.h"

namespace baton::gltf {
namespace {

constexpr std::array<std::string_view, 11> kRead{"KHR_texture_transform",
                                                 "KHR_mesh_quantization",
                                                 "KHR_materials_emissive_strength",
                                                 "KHR_materials_ior",
                                                 "KHR_materials_specular",
                                                 "KHR_materials_clearcoat",
                                                 "EXT_texture_webp",
                                                 "KHR_draco_mesh_compression",
                                                 "EXT_meshopt_compression",
                                                 "EXT_mesh_gpu_instancing",
                                                 "KHR_materials_pbrSpecularGlossiness"};

/// Extensions that only add to what a file shows without them: the look of surfaces, lights, sound,
/// words.
constexpr std::array<std::string_view, 6> kAdding{"KHR_materials_", "EXT_materials_", "KHR_lights_",
                                                  "EXT_lights_",    "KHR_audio",      "KHR_xmp"};

/// A file that needs others that are not read, such as of geometry, cannot be shown right.
void check_extensions(const JsonView& root) {
  std::string missing;
  root.each("extensionsRequired", [&](const JsonView& name) {
    const std::string text = name.as_text();
    const bool adds = std::ranges::any_of(
        kAdding, [&](std::string_view start) { return text.starts_with(start); });
    if (!adds && !is_read(text)) missing += (missing.empty() ? "" : ", ") + text;
  });
  if (!missing.empty())
    root.at("extensionsRequired")
        .fail("the file cannot be shown without what is not read: " + missing);
}

void check_version(const JsonView& root) {
  const JsonView asset = root.at("asset");
  if (!asset) root.fail("expected asset.version 2.x, got nothing");
  if (const std::string version = asset.text("version"); asset && !version.starts_with("2."))
    asset.fail("expected version 2.x, got \"" + version + "\"");
  if (const std::string least = asset.text("minVersion"); !least.empty() && least != "2.0")
    asset.fail("expected minVersion 2.0, got \"" + least + "\"");
}

Bytes copy_of(ByteView bytes) { return {bytes.begin(), bytes.end()}; }

/// What a buffer holds, at least as many bytes as it says. unread: its file, where that cannot be
/// read.
void load_buffer(const JsonView& buffer, const std::optional<ByteView>& binary,
                 const std::set<std::string>* listed, std::optional<ErrorKind>& unread,
                 Document& document) {
  // In place of what views decompress there may be nothing.
  const bool is_fallback =
      buffer.at("extensions").at("EXT_meshopt_compression").boolean("fallback");
  const std::uint64_t size = is_fallback && !buffer.has("uri") ? 0 : buffer.size("byteLength");
  Bytes bytes;
  if (buffer.has("uri")) {
    Result<Resource> resource = resolve_uri(buffer.text("uri"), document.path);
    if (!resource) return buffer.fail("uri: " + resource.error().message);
    if (resource->bytes) {
      bytes = std::move(*resource->bytes);
    } else if (listed != nullptr && !listed->contains(resource->file)) {
      return buffer.fail(not_listed(document.path, resource->file).message);
    } else {
      const Status there = expect_file(resource->file);
      Result<Bytes> file =
          there ? read_file(resource->file, limits::kMaxAssetFileBytes) : there.error();
      if (!file) {
        unread = file.error().kind;
        return buffer.fail("its file: " + file.error().message);
      }
      bytes = std::move(*file);
      document.buffer_files.push_back(resource->file);
    }
  } else if (document.buffers.empty() && binary && !is_fallback) {
    bytes = copy_of(binary->first(std::min<std::size_t>(binary->size(), size)));
  }
  if (bytes.size() < size)
    return buffer.fail(fmt::format("expected {} bytes, got {}", size, bytes.size()));
  document.buffers.push_back(std::move(bytes));
}

void load_image(const JsonView& image, Document& document) {
  Image read;
  read.view = image.index("bufferView", document.views.size());
  if (image.has("uri")) {
    Result<Resource> resource = resolve_uri(image.text("uri"), document.path);
    if (!resource) return image.fail("uri: " + resource.error().message);
    read.file = resource->file;
    if (resource->bytes) read.bytes = std::move(*resource->bytes);
  }
  if (read.view < 0 && read.file.empty() && read.bytes.empty())
    image.fail("expected a uri or a bufferView");
  document.images.push_back(std::move(read));
}

/// The bytes of a view; none, and a fault of `place`, where it is not within its buffer.
std::optional<ByteView> bytes_of(const JsonView& place, const View& view, std::size_t number,
                                 const Document& document) {
  const std::size_t size = view.buffer < 0 ? 0 : document.buffers[view.buffer].size();
  if (view.size <= size && view.offset <= size - view.size && view.buffer >= 0)
    return ByteView(document.buffers[view.buffer]).subspan(view.offset, view.size);
  if (view.size == 0 && view.offset == 0) return ByteView();
  place.fail(fmt::format("view {}: bytes {} to {} of a buffer of {}", number, view.offset,
                         view.offset + view.size, size));
  return std::nullopt;
}

/// Checks every view; those that are compressed become plain ones.
void resolve_views(const JsonView& root, Document& document) {
  const std::size_t num_buffers = document.buffers.size();
  std::size_t number = 0;
  root.each("bufferViews", [&](const JsonView& given) {
    View& view = document.views[number];
    if (const JsonView packed = given.at("extensions").at("EXT_meshopt_compression")) {
      const View source{.buffer = packed.required_index("buffer", num_buffers),
                        .offset = packed.size("byteOffset"),
                        .size = packed.size("byteLength")};
      if (const auto bytes = bytes_of(packed, source, number, document))
        decode_meshopt_view(packed, Bytes(bytes->begin(), bytes->end()), document, view);
    } else {
      (void)bytes_of(root.at("bufferViews"), view, number, document);
    }
    ++number;
  });
}

/// Decodes what is compressed of meshes.
void resolve_meshes(const JsonView& root, Document& document) {
  std::size_t m = 0;
  root.each("meshes", [&](const JsonView& mesh) {
    std::size_t p = 0;
    mesh.each("primitives", [&](const JsonView& given) {
      if (const JsonView packed = given.at("extensions").at("KHR_draco_mesh_compression"))
        decode_draco_primitive(packed, document, document.meshes[m].primitives[p]);
      ++p;
    });
    ++m;
  });
}

}  // namespace

int size_of(Component component) {
  constexpr std::array<int, 6> kSizes{1, 1, 2, 2, 4, 4};
  return kSizes.at(static_cast<std::size_t>(component));
}

ByteView Document::bytes_of_image(std::size_t image) const {
  const Image& given = images[image];
  if (given.view < 0) return given.bytes;
  const View& view = views[static_cast<std::size_t>(given.view)];
  return ByteView(buffers[static_cast<std::size_t>(view.buffer)]).subspan(view.offset, view.size);
}

std::vector<int> shown_nodes(const Document& document) {
  const auto children_of = [&](int node) -> const std::vector<int>& {
    return document.nodes[static_cast<std::size_t>(node)].children;
  };
  // A root may be below another one, or given twice.
  std::vector<bool> is_taken(document.nodes.size(), false);
  const auto take = [&](int node, std::vector<int>& nodes) {
    if (is_taken[static_cast<std::size_t>(node)]) return;
    is_taken[static_cast<std::size_t>(node)] = true;
    nodes.push_back(node);
  };
  std::vector<int> below;  // grows while it is walked, as the next one
  for (const int root : document.roots)
    for (const int child : children_of(root)) take(child, below);
  for (std::size_t i = 0; i < below.size(); ++i)
    for (const int child : children_of(below[i])) take(child, below);
  std::vector<int> nodes;
  for (const int root : document.roots) take(root, nodes);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::vector<int>& children = children_of(nodes[i]);
    nodes.insert(nodes.end(), children.begin(), children.end());
  }
  return nodes;
}

bool is_read(std::string_view extension) {
  return std::find(kRead.begin(), kRead.end(), extension) != kRead.end();
}

Error not_listed(const std::string& path, const std::string& file) {
  return {ErrorKind::bad_input,
          fmt::format("{} refers to {}, which the job was not submitted with", path, file)};
}

Result<std::shared_ptr<const Document>> parse_document(ByteView bytes, const std::string& path,
                                                       const std::set<std::string>* listed) {
  BATON_ASSIGN(const Container container, open_container(bytes, path));
  BATON_ASSIGN(const nlohmann::json json,
               parse_json_text(container.json, path + ": not a glTF file"));
  if (!json.is_object())
    return Error{ErrorKind::bad_input, path + ": not a glTF file: expected an object"};
  Fault fault;
  std::optional<ErrorKind> unread;
  const JsonView root(&json, "$", fault);
  auto document = std::make_shared<Document>();
  document->path = path;
  check_version(root);
  check_extensions(root);
  const auto good = [&] { return !fault.has_value(); };
  if (good())
    root.each("buffers", [&](const JsonView& buffer) {
      if (good()) load_buffer(buffer, container.binary, listed, unread, *document);
    });
  // Views come before images, which come before textures.
  if (good()) parse_views(root, *document);
  if (good()) resolve_views(root, *document);
  if (good()) root.each("images", [&](const JsonView& image) { load_image(image, *document); });
  if (good()) parse_lists(root, *document);
  if (good()) resolve_meshes(root, *document);
  if (fault) return Error{unread.value_or(ErrorKind::bad_input), document->error(*fault).message};
  return std::shared_ptr<const Document>(std::move(document));
}

Result<std::shared_ptr<const Document>> read_document(const std::string& path,
                                                      const std::set<std::string>* listed) {
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(path));
  if (!stamp) return Error{ErrorKind::bad_input, path + ": missing: expected a glTF file"};
  BATON_ASSIGN(const Bytes bytes, read_file(path, limits::kMaxAssetFileBytes));
  return parse_document(bytes, path, listed);
}

}  // namespace baton::gltf
