#pragma once

#include <set>
#include <string>
#include <vector>

#include "common/scene/gltf/document.h"

namespace baton::gltf {

/// A name for each of a list, no two alike, that depends on the list alone. given: some may be
/// empty or alike. The first of a given name has it; the others get their index behind it, and
/// those without a name are `what` and their index. taken: names that nothing gets.
std::vector<std::string> distinct_names(const std::vector<std::string>& given, const char* what,
                                        std::set<std::string> taken = {});

/// What people call the nodes of a file, by node: by their own name, or else that of their mesh.
/// Those without a mesh take no name from others.
std::vector<std::string> object_names(const Document& document);

}  // namespace baton::gltf
