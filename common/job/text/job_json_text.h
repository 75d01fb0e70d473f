#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace baton {

/// The value of a JSON text, in time that grows with its length. `name` goes first in every error:
/// syntax errors with line and column, numbers past the range of double, keys given twice, nesting
/// past limits::kMaxJsonDepth.
Result<nlohmann::json> parse_json_text(std::string_view text, const std::string& name);

/// `path.key`, or `path["odd key"]` when it is not a plain word; of one that is longer than
/// limits::kMaxTextLength the beginning.
std::string json_path_key(const std::string& path, std::string_view key);
/// `path[index]`
std::string json_path_index(const std::string& path, std::size_t index);

}  // namespace baton
