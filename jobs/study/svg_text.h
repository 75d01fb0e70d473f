#pragma once

#include <string>

namespace baton {

/// The text with what XML and HTML reserve written as entities.
inline std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text)
    result += c == '&'   ? "&amp;"
              : c == '<' ? "&lt;"
              : c == '>' ? "&gt;"
              : c == '"' ? "&quot;"
                         : std::string(1, c);
  return result;
}

}  // namespace baton
