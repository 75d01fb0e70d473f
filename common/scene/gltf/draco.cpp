#include <draco/compression/decode.h>
#include <fmt/format.h>

#include <cstring>
#include <memory>

#include "common/base/limits.h"
#include "common/scene/gltf/compression.h"

namespace baton::gltf {
namespace {

/// Appends a buffer and a view of all of it; the view's index.
int add_view(Bytes bytes, Document& document) {
  document.views.push_back({.buffer = static_cast<int>(document.buffers.size()),
                            .offset = 0,
                            .size = bytes.size(),
                            .stride = 0});
  document.buffers.push_back(std::move(bytes));
  return static_cast<int>(document.views.size()) - 1;
}

/// All values of an attribute as T, vertex by vertex; false: they are no numbers of that kind.
template <class T>
bool convert(const draco::PointAttribute& attribute, std::uint32_t count, int width, Bytes& to) {
  std::vector<T> values(static_cast<std::size_t>(width));
  to.resize(count * values.size() * sizeof(T));
  for (std::uint32_t i = 0; i < count; ++i) {
    const draco::AttributeValueIndex at = attribute.mapped_index(draco::PointIndex(i));
    if (!attribute.ConvertValue<T>(at, static_cast<std::int8_t>(width), values.data()))
      return false;
    std::memcpy(to.data() + i * values.size() * sizeof(T), values.data(),
                values.size() * sizeof(T));
  }
  return true;
}

bool convert_as(Component component, const draco::PointAttribute& attribute, std::uint32_t count,
                int width, Bytes& to) {
  switch (component) {
    case Component::i8:
      return convert<std::int8_t>(attribute, count, width, to);
    case Component::u8:
      return convert<std::uint8_t>(attribute, count, width, to);
    case Component::i16:
      return convert<std::int16_t>(attribute, count, width, to);
    case Component::u16:
      return convert<std::uint16_t>(attribute, count, width, to);
    case Component::u32:
      return convert<std::uint32_t>(attribute, count, width, to);
    case Component::f32:
      return convert<float>(attribute, count, width, to);
  }
  return false;
}

/// The corners of all triangles, 4 bytes each.
Bytes corners_of(const draco::Mesh& mesh) {
  Bytes bytes(std::size_t{3} * sizeof(std::uint32_t) * mesh.num_faces());
  for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
    const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(f));
    const std::array<std::uint32_t, 3> corners{face[0].value(), face[1].value(), face[2].value()};
    std::memcpy(bytes.data() + f * sizeof(corners), corners.data(), sizeof(corners));
  }
  return bytes;
}

}  // namespace

void decode_draco_primitive(const JsonView& extension, Document& document, Primitive& primitive) {
  const int from = extension.required_index("bufferView", document.views.size());
  if (from < 0) return;
  const View& view = document.views[static_cast<std::size_t>(from)];
  const ByteView bytes = ByteView(document.buffers[static_cast<std::size_t>(view.buffer)])
                             .subspan(view.offset, view.size);
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok())
    return extension.fail(fmt::format("its data: {}", decoded.status().error_msg()));
  const std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  if (mesh->num_points() > limits::kMaxGltfElements || mesh->num_faces() > limits::kMaxGltfElements)
    return extension.fail("expected fewer vertices and triangles");

  // Each attribute that the primitive names.
  for (const auto& [name, accessor] : primitive.attributes) {
    if (!extension.at("attributes").has(name.c_str())) continue;
    const auto id = static_cast<std::uint32_t>(extension.at("attributes").size(name.c_str()));
    const draco::PointAttribute* const attribute = mesh->GetAttributeByUniqueId(id);
    Accessor& target = document.accessors[static_cast<std::size_t>(accessor)];
    Bytes values;
    if (attribute == nullptr ||
        !convert_as(target.component, *attribute, mesh->num_points(), target.width, values))
      return extension.fail(fmt::format("attributes.{}: expected one of the data", name));
    target.view = add_view(std::move(values), document);
    target.offset = 0;
    target.count = mesh->num_points();
  }
  document.accessors.push_back({.view = add_view(corners_of(*mesh), document),
                                .count = std::uint64_t{3} * mesh->num_faces(),
                                .component = Component::u32,
                                .sparse = {}});
  primitive.indices = static_cast<int>(document.accessors.size()) - 1;
  primitive.mode = 4;
}

}  // namespace baton::gltf
