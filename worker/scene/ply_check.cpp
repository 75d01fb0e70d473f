#include <algorithm>
#include <charconv>
#include <cstdint>
#include <sstream>
#include <vector>

#include "worker/scene/mesh_text.h"

namespace baton {
namespace {

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::uint64_t min_bytes =
      0;  ///< of one binary record: a list of a face has at least three entries
};

struct PlyHeader {
  bool ascii = true;
  std::vector<PlyElement> elements;
};

/// Size of a scalar type by either of its names; 1 when unknown, so that a size stays a lower
/// bound.
std::uint64_t scalar_bytes(const std::string& type) {
  if (type == "double" || type == "float64") return 8;
  if (type == "float" || type == "float32" || type == "int" || type == "int32" || type == "uint" ||
      type == "uint32") {
    return 4;
  }
  return type == "short" || type == "int16" || type == "ushort" || type == "uint16" ? 2 : 1;
}

PlyHeader parse_header(const std::string& text) {
  PlyHeader header;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string keyword, type, list_type;
    words >> keyword;
    if (keyword == "format") {
      words >> type;
      header.ascii = type == "ascii";
    } else if (keyword == "element") {
      PlyElement element;
      words >> element.name >> element.count;
      header.elements.push_back(element);
    } else if (keyword == "property" && !header.elements.empty()) {
      PlyElement& element = header.elements.back();
      words >> type;
      if (type == "list") {
        words >> type >> list_type;
        element.min_bytes +=
            scalar_bytes(type) + (element.name == "face" ? 3 * scalar_bytes(list_type) : 0);
      } else {
        element.min_bytes += scalar_bytes(type);
      }
    }
  }
  return header;
}

/// Lines with anything on them.
std::uint64_t count_lines(std::string_view text) {
  std::uint64_t lines = 0;
  bool empty = true;
  for (const char c : text) {
    if (c == '\n') empty = true;
    if (c == '\n' || c == '\r' || c == ' ' || !empty) continue;
    empty = false;
    ++lines;
  }
  return lines;
}

}  // namespace

std::optional<std::string> find_ply_truncation(std::string_view bytes) {
  constexpr std::string_view kEnd = "end_header";
  const std::size_t end = bytes.find(kEnd);
  if (end == std::string_view::npos) return std::nullopt;
  const PlyHeader header = parse_header(std::string(bytes.substr(0, end)));
  const std::size_t body_begin = std::min(bytes.find('\n', end), bytes.size() - 1) + 1;
  const std::string_view body = bytes.substr(body_begin);

  // Compare records (text) or bytes with what the header promises.
  double expected = 0;  // counts are not to be trusted: no overflow
  for (const PlyElement& element : header.elements) {
    expected += static_cast<double>(element.count) *
                (header.ascii ? 1.0 : static_cast<double>(element.min_bytes));
  }
  const std::uint64_t found = header.ascii ? count_lines(body) : body.size();
  if (static_cast<double>(found) >= expected) return std::nullopt;
  std::ostringstream message;
  message.precision(15);
  message << "truncated: the header promises " << (header.ascii ? "" : "at least ") << expected
          << (header.ascii ? " lines" : " bytes") << " of data, found " << found;
  return message.str();
}

}  // namespace baton
