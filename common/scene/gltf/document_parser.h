#pragma once

#include "common/scene/gltf/document.h"
#include "common/scene/gltf/json_view.h"

namespace baton::gltf {

/// Fill `document` from the root of a glTF's JSON. Buffers, views and images come in this order, so
/// that every index can be checked: first the views, when the buffers are there.
void parse_views(const JsonView& root, Document& document);
/// All that refers to views and images.
void parse_lists(const JsonView& root, Document& document);

/// Materials and textures (document_materials.cpp).
void parse_materials(const JsonView& root, Document& document);

}  // namespace baton::gltf
