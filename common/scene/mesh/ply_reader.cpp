#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "common/scene/mesh/mesh_readers.h"
#include "common/scene/mesh/mesh_text.h"
#include "common/scene/mesh/polygons.h"

namespace baton {
namespace {

enum class Scalar : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
enum class Format : std::uint8_t { text, little_endian, big_endian };

/// What a property says of the mesh.
enum class Role : std::uint8_t {
  nothing,
  x,
  y,
  z,
  nx,
  ny,
  nz,
  red,
  green,
  blue,
  alpha,
  corners,
  strips
};

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
  bool has_unread_color = false;
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

constexpr std::pair<std::string_view, Role> kOfVertex[] = {{"x", Role::x},
                                                           {"y", Role::y},
                                                           {"z", Role::z},
                                                           {"nx", Role::nx},
                                                           {"ny", Role::ny},
                                                           {"nz", Role::nz},
                                                           {"red", Role::red},
                                                           {"green", Role::green},
                                                           {"blue", Role::blue},
                                                           {"alpha", Role::alpha},
                                                           {"r", Role::red},
                                                           {"g", Role::green},
                                                           {"b", Role::blue},
                                                           {"a", Role::alpha},
                                                           {"diffuse_red", Role::red},
                                                           {"diffuse_green", Role::green},
                                                           {"diffuse_blue", Role::blue},
                                                           {"diffuse_alpha", Role::alpha}};

constexpr bool is_color(Role role) { return role >= Role::red && role <= Role::alpha; }

Role role_of_vertex(std::string_view name) {
  const auto* const found =
      std::ranges::find(kOfVertex, name, &std::pair<std::string_view, Role>::first);
  return found != std::end(kOfVertex) ? found->second : Role::nothing;
}

Role role_of(const std::string& element, const Property& property) {
  const std::string& name = property.name;
  if (property.count_type) {
    if (name != "vertex_indices" && name != "vertex_index") return Role::nothing;
    return element == "face"        ? Role::corners
           : element == "tristrips" ? Role::strips
                                    : Role::nothing;
  }
  return element == "vertex" ? role_of_vertex(name) : Role::nothing;
}

/// Marks elements whose colours count for nothing: of faces, and of vertices without all three.
void find_unread_colors(Header& header) {
  for (Element& element : header.elements) {
    std::set<Role> colors;
    for (const Property& property : element.properties) {
      const Role role = role_of_vertex(property.name);
      if (!property.count_type && is_color(role)) colors.insert(role);
    }
    const bool has_all =
        colors.contains(Role::red) && colors.contains(Role::green) && colors.contains(Role::blue);
    const bool is_read = element.is_vertex && has_all;
    element.has_unread_color =
        !colors.empty() && !is_read && (element.is_vertex || element.name == "face");
    if (is_read || !element.is_vertex) continue;
    for (Property& property : element.properties) {
      if (is_color(property.role)) property.role = Role::nothing;
    }
  }
}

Result<Header> parse_header(std::string_view bytes, const std::string& name) {
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, name + ": " + what};
  };
  if (!bytes.starts_with("ply")) return fail("not a mesh: expected \"ply\" in line 1");
  Header header;
  int line_number = 0;
  // All lines end as the first one: binary data may begin as a line end does.
  const LineEnd first = find_line_end(bytes);
  const std::string_view line_end = bytes.substr(first.length, first.next - first.length);
  while (header.size_bytes < bytes.size()) {
    const std::size_t end =
        std::min(bytes.find(line_end == "\r" ? '\r' : '\n', header.size_bytes), bytes.size());
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
      find_unread_colors(header);
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
    const std::size_t begin = at_;
    while (at_ < bytes_.size() && static_cast<unsigned char>(bytes_[at_]) > ' ') ++at_;
    return real_number(bytes_.substr(begin, at_ - begin));
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

/// What an integer of a type stands for at most; 0: it is no integer. Who writes 32 bits means
/// bytes.
double full_scale(Scalar type) {
  constexpr std::array<double, 8> kMost{127, 255, 32767, 65535, 255, 255, 0, 0};
  return kMost.at(static_cast<std::size_t>(type));
}

/// IEC 61966-2-1; alpha is a number.
float channel_of(double value, Scalar type, bool is_alpha, bool& is_sound) {
  const double most = full_scale(type);
  const double v = color_channel(most > 0 ? value / most : value, is_sound);
  if (most == 0 || is_alpha) return static_cast<float>(v);
  return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

/// Reads the elements of one file into polygons.
class PlyReader {
 public:
  PlyReader(std::string_view body, const Header& header, const std::string& name, bool with_normals)
      : header_(header), name_(name), values_(body, header.format), with_normals_(with_normals) {
    bool has_blue = false, has_normal = false;
    for (const Element& element : header.elements) {
      for (const Property& property : element.properties) {
        has_blue = has_blue || property.role == Role::blue;
        has_normal = has_normal || property.role == Role::nz;
      }
    }
    with_colors_ = has_blue;
    with_normals_ = with_normals && has_normal;
  }

  Result<TriangleMesh> read() {
    for (const Element& element : header_.elements) {
      for (std::uint64_t i = 0; i < element.count; ++i) BATON_TRY(read_record(element, i));
    }
    BATON_TRY(check_corners());
    return mesh_of(polygons_, with_normals_, false);
  }

 private:
  Error error_at(const std::string& element, std::uint64_t index, const std::string& what) const {
    return {ErrorKind::bad_input,
            name_ + ": " + element + " " + std::to_string(index) + ": " + what};
  }

  Status read_record(const Element& element, std::uint64_t index) {
    std::array<double, 12> values{};  // by role
    values[static_cast<std::size_t>(Role::alpha)] = 1;
    VertexColor color{1, 1, 1, 1};
    bool is_sound = true;
    for (const Property& property : element.properties) {
      const std::optional<double> value = values_.next(property.count_type.value_or(property.type));
      if (!value)
        return error_at(element.name, index, "expected a number of property " + property.name);
      if (property.count_type) {
        BATON_TRY(read_list(element, index, property, *value));
      } else if (is_color(property.role)) {
        const auto channel =
            static_cast<std::size_t>(property.role) - static_cast<std::size_t>(Role::red);
        color[channel] = channel_of(*value, property.type, property.role == Role::alpha, is_sound);
      } else {
        values[static_cast<std::size_t>(property.role)] = *value;
      }
    }

    polygons_.unread_colors += element.has_unread_color ? 1 : 0;
    polygons_.bad_colors += is_sound ? 0 : 1;
    polygons_.lines += element.name == "edge" ? 1 : 0;
    if (!element.is_vertex) return {};
    polygons_.positions.push_back({values[1], values[2], values[3]});
    if (with_normals_)
      polygons_.normals.push_back({static_cast<float>(values[4]), static_cast<float>(values[5]),
                                   static_cast<float>(values[6])});
    if (with_colors_) polygons_.colors.push_back(color);
    return {};
  }

  /// Reads `count` entries; those of a face's corners and of strips become faces.
  Status read_list(const Element& element, std::uint64_t index, const Property& property,
                   double count) {
    if (!(count >= 0 && count <= 0xFFFFFFFFu))
      return error_at(element.name, index, "expected the length of a list");
    strip_.clear();
    std::uint32_t size = 0;
    for (double k = 0; k < count; ++k) {
      const std::optional<double> value = values_.next(property.type);
      if (!value)
        return error_at(element.name, index, "expected a number of property " + property.name);
      if (property.role == Role::nothing) continue;
      // A strip ends at -1, and the next one begins.
      if (property.role == Role::strips && *value == -1) {
        strip_.clear();
        continue;
      }
      if (!(*value >= 0 && *value < 0xFFFFFFFFu)) return bad_corner(element.name, index);
      const auto corner = static_cast<std::uint32_t>(*value);
      if (property.role == Role::strips) {
        add_to_strip(corner);
      } else {
        polygons_.corners.push_back(corner);
        ++size;
      }
    }
    if (property.role == Role::corners) {
      polygons_.sizes.push_back(size);
      polygons_.lines += size < 3 ? 1 : 0;
    }
    return {};
  }

  /// Every second triangle of a strip turns the other way.
  void add_to_strip(std::uint32_t corner) {
    strip_.push_back(corner);
    const std::size_t n = strip_.size();
    if (n < 3) return;
    const bool is_odd = n % 2 == 0;
    for (const std::uint32_t c :
         {strip_[n - (is_odd ? 2 : 3)], strip_[n - (is_odd ? 3 : 2)], corner})
      polygons_.corners.push_back(c);
    polygons_.sizes.push_back(3);
  }

  Error bad_corner(const std::string& element, std::uint64_t index) const {
    std::uint64_t vertices = 0;
    for (const Element& e : header_.elements) vertices += e.is_vertex ? e.count : 0;
    return error_at(element, index, "expected a vertex index below " + std::to_string(vertices));
  }

  /// Faces may come before vertices.
  Status check_corners() const {
    std::size_t corner = 0;
    for (std::size_t face = 0; face < polygons_.num_faces(); ++face) {
      for (std::uint32_t k = 0; k < polygons_.sizes[face]; ++k, ++corner) {
        if (polygons_.corners[corner] >= polygons_.positions.size())
          return bad_corner("face", face);
      }
    }
    return {};
  }

  const Header& header_;
  const std::string& name_;
  ValueReader values_;
  bool with_normals_, with_colors_ = false;
  Polygons polygons_;
  std::vector<std::uint32_t> strip_;
};

}  // namespace

Result<TriangleMesh> parse_ply(std::string_view file, const std::string& name, bool with_normals) {
  BATON_ASSIGN(const std::string_view bytes, without_mark(file, name));
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
