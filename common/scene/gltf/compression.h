#pragma once

#include "common/scene/gltf/document.h"
#include "common/scene/gltf/json_view.h"

/// Compressed data of a glTF file becomes plain data: buffers, views and accessors that the rest
/// reads as any other.
namespace baton::gltf {

/// Decodes a view of EXT_meshopt_compression into a buffer of its own. bytes: what the view of the
/// extension holds. Faults: those of the extension, data that is damaged.
void decode_meshopt_view(const JsonView& extension, ByteView bytes, Document& document, View& view);

/// Decodes a primitive of KHR_draco_mesh_compression; its accessors, which stay as the file has
/// them but for their number of elements, then refer to what was decoded. Faults as above.
void decode_draco_primitive(const JsonView& extension, Document& document, Primitive& primitive);

}  // namespace baton::gltf
