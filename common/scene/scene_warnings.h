#pragma once

#include <string>
#include <vector>

#include "common/job/scene_spec.h"

namespace baton {

/// What of a settled scene is not shown, or not as someone may expect: surfaces that glow, what its
/// glTF files have and Baton does not read, materials that stand for none of such a file. One line
/// each.
std::vector<std::string> scene_warnings(const SceneSpec& scene);

}  // namespace baton
