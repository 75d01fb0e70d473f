#include "common/scene/gltf/names.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/suggest.h"

namespace baton::gltf {

std::vector<std::string> distinct_names(const std::vector<std::string>& given, const char* what,
                                        std::set<std::string> taken) {
  const std::set<std::string> all_given(given.begin(), given.end());
  const auto take = [&](const std::string& name) {
    return !all_given.contains(name) && taken.insert(name).second;
  };
  std::vector<std::string> names;
  for (std::size_t i = 0; i < given.size(); ++i) {
    std::string name = given[i].empty() ? fmt::format("{} {}", what, i) : given[i];
    bool is_own = given[i].empty() ? take(name) : taken.insert(name).second;
    while (!is_own) {
      name = fmt::format("{} ({})", name, i);
      is_own = take(name);
    }
    names.push_back(name);
  }
  return names;
}

std::vector<std::string> object_names(const Document& document) {
  std::vector<std::string> given;
  for (const Node& node : document.nodes) {
    const bool shows_mesh = node.mesh >= 0;
    given.push_back(!shows_mesh ? "" : node.name.empty() ? document.mesh_of(node).name : node.name);
  }
  return distinct_names(given, "node");
}

std::vector<std::string> animation_names(const Document& document) {
  return distinct_names(document.animations, "animation");
}

Result<int> find_animation(const Document& document, const std::string& choice) {
  if (choice.empty()) return -1;
  const std::vector<std::string> names = animation_names(document);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names[i] == choice) return static_cast<int>(i);
  for (std::size_t i = 0; i < names.size(); ++i)
    if (std::to_string(i) == choice) return static_cast<int>(i);
  return document.error(fmt::format("no animation \"{}\"{}", choice,
                                    names.empty() ? "; it has none" : suggestion(choice, names)));
}

std::string shown_names(const std::vector<std::string>& names) {
  constexpr std::size_t kMostShown = 12;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMostShown); ++i)
    text += fmt::format("{}\"{}\"", i > 0 ? ", " : "", names[i]);
  if (names.size() > kMostShown) text += fmt::format(" and {} more", names.size() - kMostShown);
  return text;
}

}  // namespace baton::gltf
