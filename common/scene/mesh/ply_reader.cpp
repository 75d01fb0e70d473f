#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "common/scene/mesh/mesh_builder.h"
#include "common/scene/mesh/mesh_readers.h"

namespace baton {
namespace {

enum class Scalar : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class Format : std::uint8_t { text, little_endian, big_endian };

/// What a property says of the mesh.
enum class Role : std::uint8_t { nothing, x, y, z, nx, ny, nz, corners };

struct Property {
  std::string name;
  Scalar type = Scalar::float32;
  std::optional<Scalar> count_type;  ///< a list
  Role role = Role::nothing;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
  bool is_vertex = false;
};

struct Header {
  Format format = Format::text;
  std::vector<Element> elements;
  std::size_t size_bytes = 0;
};

std::optional<Scalar> scalar_of(const std::string& type) {
  static constexpr std::pair<std::string_view, Scalar> kNames[] = {
      {"char", Scalar::int8},      {"int8", Scalar::int8},       {"uchar", Scalar::uint8},
      {"uint8", Scalar::uint8},    {"short", Scalar::int16},     {"int16", Scalar::int16},
      {"ushort", Scalar::uint16},  {"uint16", Scalar::uint16},   {"int", Scalar::int32},
      {"int32", Scalar::int32},    {"uint", Scalar::uint32},     {"uint32", Scalar::uint32},
      {"float", Scalar::float32},  {"float32", Scalar::float32}, {"double", Scalar::float64},
      {"float64", Scalar::float64}};
  for (const auto& [name, scalar] : kNames) {
    if (name == type) return scalar;
  }
  return std::nullopt;
}

std::optional<Format> format_of(const std::string& word) {
  if (word == "ascii") return Format::text;
  if (word == "binary_little_endian") return Format::little_endian;
  if (word == "binary_big_endian") return Format::big_endian;
  return std::nullopt;
}

/// "property <type> <name>" or "property list <count type> <type> <name>", after the keyword.
std::optional<Property> parse_property(std::istringstream& words) {
  std::string type, list_type;
  words >> type;
  Property property;
  if (type == "list") {
    words >> list_type >> type;
    property.count_type = scalar_of(list_type);
    if (!property.count_type) return std::nullopt;
  }
  words >> property.name;
  const std::optional<Scalar> scalar = scalar_of(type);
  if (!scalar || property.name.empty()) return std::nullopt;
  property.type = *scalar;
  return property;
}

Role role_of(const std::string& element, const Property& property) {
  using Named = std::pair<std::string_view, Role>;
  static constexpr std::array<Named, 6> kOfVertex{{{"x", Role::x},
                                                   {"y", Role::y},
                                                   {"z", Role::z},
                                                   {"nx", Role::nx},
                                                   {"ny", Role::ny},
                                                   {"nz", Role::nz}}};
  const std::string& name = property.name;
  if (property.count_type) {
    const bool corners = element == "face" && (name == "vertex_indices" || name == "vertex_index");
    return corners ? Role::corners : Role::nothing;
  }
  if (element != "vertex") return Role::nothing;
  const auto* const found = std::ranges::find(kOfVertex, name, &Named::first);
  return found != kOfVertex.end() ? found->second : Role::nothing;
}

Result<Header> parse_header(std::string_view bytes, const std::string& name) {
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, name + ": " + what};
  };
  if (!bytes.starts_with("ply")) return fail("not a mesh: expected \"ply\" in line 1");
  Header header;
  int line_number = 0;
  while (header.size_bytes < bytes.size()) {
    const std::size_t end = std::min(bytes.find('\n', header.size_bytes), bytes.size());
    const std::string line(bytes.substr(header.size_bytes, end - header.size_bytes));
    header.size_bytes = std::min(end + 1, bytes.size());
    std::istringstream words(line);
    std::string keyword, word;
    words >> keyword;
    const auto bad_line = [&] {
      return fail("line " + std::to_string(line_number) + ": not a line of a PLY header: \"" +
                  line.substr(0, 60) + "\"");
    };
    ++line_number;
    if (keyword == "ply" && line_number == 1) continue;
    if (keyword == "end_header") {
      return header;
    } else if (keyword == "format") {
      words >> word;
      const std::optional<Format> format = format_of(word);
      if (!format) return bad_line();
      header.format = *format;
    } else if (keyword == "element") {
      Element element;
      if (!(words >> element.name >> element.count)) return bad_line();
      element.is_vertex = element.name == "vertex";
      header.elements.push_back(element);
    } else if (keyword == "property" && !header.elements.empty()) {
      std::optional<Property> property = parse_property(words);
      if (!property) return bad_line();
      property->role = role_of(header.elements.back().name, *property);
      header.elements.back().properties.push_back(std::move(*property));
    } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
      return bad_line();
    }
  }
  return fail("truncated: expected end_header");
}

/// The values after the header, one by one; nullopt past the end and where text is no number.
class ValueReader {
 public:
  ValueReader(std::string_view bytes, Format format) : bytes_(bytes), format_(format) {}

  std::optional<double> next(Scalar type) {
    if (format_ == Format::text) return next_word();
    switch (type) {
      case Scalar::int8:
        return next_binary<std::int8_t>();
      case Scalar::uint8:
        return next_binary<std::uint8_t>();
      case Scalar::int16:
        return next_binary<std::int16_t>();
      case Scalar::uint16:
        return next_binary<std::uint16_t>();
      case Scalar::int32:
        return next_binary<std::int32_t>();
      case Scalar::uint32:
        return next_binary<std::uint32_t>();
      case Scalar::float32:
        return next_binary<float>();
      case Scalar::float64:
        return next_binary<double>();
    }
    return std::nullopt;
  }

 private:
  std::optional<double> next_word() {
    while (at_ < bytes_.size() && static_cast<unsigned char>(bytes_[at_]) <= ' ') ++at_;
    if (at_ < bytes_.size() && bytes_[at_] == '+') ++at_;
    double value = 0;
    const char* begin = bytes_.data() + at_;
    const auto [end, error] = std::from_chars(begin, bytes_.data() + bytes_.size(), value);
    if (error != std::errc{}) return std::nullopt;
    at_ += static_cast<std::size_t>(end - begin);
    return value;
  }
  template <class T>
  std::optional<double> next_binary() {
    if (bytes_.size() - at_ < sizeof(T)) return std::nullopt;
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    if (format_ == Format::big_endian) std::reverse(raw.begin(), raw.end());
    return static_cast<double>(std::bit_cast<T>(raw));
  }

  std::string_view bytes_;
  Format format_;
  std::size_t at_ = 0;
};

/// Reads the elements of one file into a mesh.
class PlyReader {
 public:
  PlyReader(std::string_view body, const Header& header, const std::string& name, bool with_normals)
      : header_(header), name_(name), values_(body, header.format), with_normals_(with_normals) {}

  Result<TriangleMesh> read() {
    for (const Element& element : header_.elements) {
      for (std::uint64_t i = 0; i < element.count; ++i) BATON_TRY(read_record(element, i));
    }
    MeshBuilder builder({.normals = with_normals_});
    builder.begin_part(positions_.size());
    for (const auto& t : triangles_) {
      builder.add(t, {positions_[t[0]], positions_[t[1]], positions_[t[2]]},
                  {normals_[t[0]], normals_[t[1]], normals_[t[2]]});
    }
    return builder.take();
  }

 private:
  Error error_at(const Element& element, std::uint64_t index, const std::string& what) const {
    return {ErrorKind::bad_input,
            name_ + ": " + element.name + " " + std::to_string(index) + ": " + what};
  }

  Status read_record(const Element& element, std::uint64_t index) {
    Vec3 position, normal;
    const std::array<float*, 7> targets{nullptr,   &position.x, &position.y, &position.z,
                                        &normal.x, &normal.y,   &normal.z};
    for (const Property& property : element.properties) {
      const std::optional<double> value = values_.next(property.count_type.value_or(property.type));
      if (!value) return error_at(element, index, "expected a number of property " + property.name);
      if (property.count_type) {
        BATON_TRY(read_list(element, index, property, *value));
      } else if (property.role != Role::nothing) {
        *targets[static_cast<std::size_t>(property.role)] = static_cast<float>(*value);
      }
    }

    // A file with one unusable normal has none.
    if (!element.is_vertex) return {};
    if (!std::isfinite(position.x) || !std::isfinite(position.y) || !std::isfinite(position.z)) {
      return error_at(element, index, "expected finite coordinates");
    }
    const float norm = length(normal);
    with_normals_ = with_normals_ && norm > 0 && std::isfinite(norm);
    positions_.push_back(position);
    normals_.push_back(normalize(normal));
    return {};
  }

  /// Reads `count` entries; those of a face's corners become triangles around its first.
  Status read_list(const Element& element, std::uint64_t index, const Property& property,
                   double count) {
    if (!(count >= 0 && count <= 0xFFFFFFFFu))
      return error_at(element, index, "expected the length of a list");
    std::array<std::uint32_t, 3> fan{};
    for (double k = 0; k < count; ++k) {
      const std::optional<double> value = values_.next(property.type);
      if (!value) return error_at(element, index, "expected a number of property " + property.name);
      if (property.role != Role::corners) continue;
      if (!(*value >= 0 && *value < static_cast<double>(positions_.size()))) {
        return error_at(element, index,
                        "expected a vertex index below " + std::to_string(positions_.size()));
      }
      fan[k < 2 ? static_cast<std::size_t>(k) : 2] = static_cast<std::uint32_t>(*value);
      if (k < 2) continue;
      triangles_.push_back(fan);
      fan[1] = fan[2];
    }
    return {};
  }

  const Header& header_;
  const std::string& name_;
  ValueReader values_;
  bool with_normals_;
  std::vector<Vec3> positions_, normals_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
};

}  // namespace

Result<TriangleMesh> parse_ply(std::string_view bytes, const std::string& name, bool with_normals) {
  BATON_ASSIGN(const Header header, parse_header(bytes, name));

  // A record without properties takes no bytes: its count could not be checked by reading.
  for (const Element& element : header.elements) {
    if (element.count > 0 && element.properties.empty()) {
      return Error{ErrorKind::bad_input,
                   name + ": element " + element.name + ": expected properties"};
    }
  }
  return PlyReader(bytes.substr(header.size_bytes), header, name, with_normals).read();
}

}  // namespace baton
