#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace baton {

/// What --json prints; indent < 0: one line. Bytes that are no UTF-8, as a folder's name can have
/// them, become U+FFFD: no name ends a program.
std::string json_text(const nlohmann::ordered_json& value, int indent = -1);

}  // namespace baton
