#pragma once

#include <string>
#include <vector>

#include "common/job/job_spec.h"
#include "common/scene/gltf/document.h"

namespace baton::gltf {

/// A name for each material, no two alike: first that of the default material, then that of
/// material 0 and so on.
std::vector<std::string> material_names(const Document& document);

/// A material of the file as a job says it; -1: the default material of glTF.
MaterialSpec material_spec(const Document& document, int material);
/// The same without textures.
MaterialSpec plain_material_spec(const Document& document, int material);

/// What a material has and Baton does not show, one text each.
std::vector<std::string> unsupported_parts(const Document& document, const Material& material);

}  // namespace baton::gltf
