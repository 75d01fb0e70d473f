#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <system_error>

#include "common/scene/mesh/mesh_readers.h"
#include "common/scene/mesh/polygons.h"

namespace baton {
namespace {

/// Least bytes of a vertex ("0 0 0\n") and of a face ("0\n"): counts past the file's size are
/// refused before they are believed.
constexpr std::uint64_t kMinVertexBytes = 6;
constexpr std::uint64_t kMinFaceBytes = 2;

/// Words of a text with '#' comments, and the line they are on.
class WordReader {
 public:
  explicit WordReader(std::string_view text) : text_(text) {}

  /// The next word on this or a later line; empty at the end.
  std::string_view word() {
    skip_space();
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_]) && text_[at_] != '#') ++at_;
    return text_.substr(begin, at_ - begin);
  }
  void skip_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }
  template <class T>
  std::optional<T> number() {
    std::string_view digits = word();
    if (digits.starts_with('+')) digits.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
    return value;
  }
  int line() const { return line_; }
  /// Whether the line has another word.
  bool goes_on() const {
    const std::size_t next = std::min(text_.find_first_not_of(" \t\r", at_), text_.size());
    return next < text_.size() && text_[next] != '\n' && text_[next] != '#';
  }
  bool at_end() {
    skip_space();
    return at_ == text_.size();
  }

 private:
  static bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }
  void skip_space() {
    for (; at_ < text_.size(); ++at_) {
      if (text_[at_] == '#') skip_line();
      if (at_ == text_.size() || !is_space(text_[at_])) return;
      line_ += text_[at_] == '\n';
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

Error off_error(const std::string& name, WordReader& reader, const std::string& what) {
  const std::string place = name + ": line " + std::to_string(reader.line()) + ": ";
  return {ErrorKind::bad_input, place + what + (reader.at_end() ? ", but the file ends here" : "")};
}

Result<std::vector<Position>> read_vertices(WordReader& reader, std::uint32_t count,
                                            const std::string& name) {
  std::vector<Position> vertices;
  vertices.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto x = reader.number<double>();
    const auto y = x ? reader.number<double>() : std::nullopt;
    const auto z = y ? reader.number<double>() : std::nullopt;
    if (!z)
      return off_error(name, reader, "expected three coordinates of vertex " + std::to_string(i));
    vertices.push_back({*x, *y, *z});
    reader.skip_line();
  }
  return vertices;
}

Status read_face(WordReader& reader, std::uint32_t face, const std::string& name,
                 Polygons& polygons) {
  const auto corners = reader.number<std::uint32_t>();
  if (!corners)
    return off_error(name, reader,
                     "expected the number of corners of face " + std::to_string(face));
  for (std::uint32_t k = 0; k < *corners; ++k) {
    const auto index = reader.number<std::uint32_t>();
    if (!index || *index >= polygons.positions.size()) {
      return off_error(name, reader,
                       "expected a vertex index below " +
                           std::to_string(polygons.positions.size()) + " in face " +
                           std::to_string(face));
    }
    polygons.corners.push_back(*index);
  }
  polygons.sizes.push_back(*corners);
  polygons.lines += *corners < 3 ? 1 : 0;
  if (reader.goes_on()) ++polygons.unread_colors;
  reader.skip_line();
  return {};
}

}  // namespace

Result<TriangleMesh> parse_off(std::string_view text, const std::string& name) {
  WordReader reader(text);
  const std::string_view magic = reader.word();
  if (magic != "OFF" && magic != "COFF" && magic != "NOFF" && magic != "CNOFF") {
    return Error{ErrorKind::bad_input, name + ": not a mesh: expected \"OFF\" in line 1"};
  }

  // The third count, of edges, is optional and without a meaning.
  const auto num_vertices = reader.number<std::uint32_t>();
  const auto num_faces = num_vertices ? reader.number<std::uint32_t>() : std::nullopt;
  if (!num_faces) return off_error(name, reader, "expected the numbers of vertices and faces");
  if (*num_vertices * kMinVertexBytes + *num_faces * kMinFaceBytes > text.size()) {
    return off_error(name, reader,
                     "expected " + std::to_string(*num_vertices) + " vertices and " +
                         std::to_string(*num_faces) +
                         " faces, which the file is too small to hold");
  }
  reader.skip_line();

  Polygons polygons;
  BATON_ASSIGN(polygons.positions, read_vertices(reader, *num_vertices, name));
  if (magic.starts_with('C')) polygons.unread_colors = polygons.positions.size();
  for (std::uint32_t face = 0; face < *num_faces; ++face)
    BATON_TRY(read_face(reader, face, name, polygons));
  return mesh_of(polygons, false, false);
}

}  // namespace baton
