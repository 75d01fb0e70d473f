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

/// What a job calls the animations of a file, no two alike.
std::vector<std::string> animation_names(const Document& document);
/// The animation that a job chooses by its name or its place in the file's list; empty: -1, all of
/// them. Error: not there.
Result<int> find_animation(const Document& document, const std::string& choice);
/// Names between quotes, a dozen at most, and how many more there are.
std::string shown_names(const std::vector<std::string>& names);

}  // namespace baton::gltf
