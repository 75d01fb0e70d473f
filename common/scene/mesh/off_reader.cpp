#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "common/scene/mesh/mesh_readers.h"
#include "common/scene/mesh/mesh_text.h"
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
    while (at_ < text_.size() && !is_space(text_[at_]) && !is_comment(text_, at_)) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  void skip_line() {
    while (at_ < text_.size() && !is_line_end(text_[at_])) ++at_;
  }
  std::optional<std::uint32_t> count() {
    std::string_view digits = word();
    if (digits.starts_with('+')) digits.remove_prefix(1);
    std::uint32_t value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
    return value;
  }
  std::optional<double> number() { return real_number(word()); }
  int line() const { return line_; }
  /// Whether the line has another word.
  bool goes_on() const {
    const std::size_t next = std::min(text_.find_first_not_of(" \t", at_), text_.size());
    return next < text_.size() && !is_line_end(text_[next]) && text_[next] != '#';
  }
  bool at_end() {
    skip_space();
    return at_ == text_.size();
  }

 private:
  static bool is_line_end(char c) { return c == '\r' || c == '\n'; }
  static bool is_space(char c) { return c == ' ' || c == '\t' || is_line_end(c); }
  void skip_space() {
    for (; at_ < text_.size(); ++at_) {
      if (is_comment(text_, at_)) skip_line();
      if (at_ == text_.size() || !is_space(text_[at_])) return;
      const bool is_half = text_.substr(at_).starts_with("\r\n");
      line_ += is_line_end(text_[at_]) && !is_half;
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
};

/// What the first word says of the vertices.
struct Form {
  bool has_texture = false, has_colors = false, has_normals = false;
  /// The fourth number of a vertex divides the others.
  bool is_homogeneous = false;
  /// The number of coordinates comes before the counts.
  bool has_dimension = false;

  int coordinates() const { return is_homogeneous ? 4 : 3; }
  /// Numbers behind the coordinates. Colours are red, green, blue, alpha.
  int others() const {
    return (has_normals ? 3 : 0) + (has_colors ? 4 : 0) + (has_texture ? 2 : 0);
  }
};

/// "[ST][C][N][4][n]OFF"; nullopt: another word.
std::optional<Form> form_of(std::string_view word) {
  const auto takes = [&](std::string_view prefix) {
    const bool has = word.starts_with(prefix);
    if (has) word.remove_prefix(prefix.size());
    return has;
  };
  Form form;
  form.has_texture = takes("ST");
  form.has_colors = takes("C");
  form.has_normals = takes("N");
  form.is_homogeneous = takes("4");
  form.has_dimension = takes("n");
  return word == "OFF" ? std::optional(form) : std::nullopt;
}

Error off_error(const std::string& name, WordReader& reader, const std::string& what) {
  const std::string place = name + ": line " + std::to_string(reader.line()) + ": ";
  return {ErrorKind::bad_input, place + what + (reader.at_end() ? ", but the file ends here" : "")};
}

/// Whether each vertex and each face has a line of its own. reader: before the first vertex.
bool has_a_line_each(WordReader reader, const Form& form, std::uint64_t records) {
  WordReader first = reader;
  (void)first.word();
  const int line = first.line();
  for (int k = 1; k < form.coordinates(); ++k) (void)first.word();
  if (first.line() != line) return false;
  std::uint64_t lines = 0;
  for (; lines < records && !reader.at_end(); ++lines) reader.skip_line();
  return lines == records;
}

Result<std::vector<Position>> read_vertices(WordReader& reader, std::uint32_t count,
                                            const Form& form, bool is_by_line,
                                            const std::string& name) {
  std::vector<Position> vertices;
  vertices.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    std::array<double, 4> p{0, 0, 0, 1};
    for (int k = 0; k < form.coordinates(); ++k) {
      const auto number = reader.number();
      if (!number)
        return off_error(name, reader, "expected three coordinates of vertex " + std::to_string(i));
      p[static_cast<std::size_t>(k)] = *number;
    }
    vertices.push_back({p[0] / p[3], p[1] / p[3], p[2] / p[3]});
    if (is_by_line) {
      reader.skip_line();
      continue;
    }
    for (int k = 0; k < form.others(); ++k) {
      if (!reader.number())
        return off_error(name, reader,
                         "expected " + std::to_string(form.others()) +
                             " numbers behind the coordinates of vertex " + std::to_string(i));
    }
  }
  return vertices;
}

Status read_face(WordReader& reader, std::uint32_t face, bool has_color, const std::string& name,
                 Polygons& polygons) {
  const auto corners = reader.count();
  if (!corners)
    return off_error(name, reader,
                     "expected the number of corners of face " + std::to_string(face));
  for (std::uint32_t k = 0; k < *corners; ++k) {
    const auto index = reader.count();
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
  if (!has_color) return {};
  if (reader.goes_on()) ++polygons.unread_colors;
  reader.skip_line();
  return {};
}

/// Colours of faces end with the line; where faces without any are all that is left, there are
/// none.
Status read_faces(WordReader& reader, std::uint32_t count, bool is_by_line, const std::string& name,
                  Polygons& polygons) {
  if (!is_by_line) {
    WordReader plain_reader = reader;
    Polygons plain = polygons;
    bool is_plain = true;
    for (std::uint32_t face = 0; face < count && is_plain; ++face)
      is_plain = read_face(plain_reader, face, false, name, plain).ok();
    if (is_plain && plain_reader.at_end()) {
      polygons = std::move(plain);
      return {};
    }
  }
  for (std::uint32_t face = 0; face < count; ++face)
    BATON_TRY(read_face(reader, face, true, name, polygons));
  return {};
}

/// The first word, which may be missing, and the dimension.
Result<Form> read_form(WordReader& reader, const std::string& name) {
  WordReader ahead = reader;
  const std::string_view magic = ahead.word();
  const std::optional<Form> form = form_of(magic);
  if (!form) {
    if (WordReader(reader).count()) return Form();
    return Error{ErrorKind::bad_input, name + ": not a mesh: expected \"OFF\" in line 1"};
  }
  reader = ahead;
  if (ahead.word() == "BINARY")
    return Error{ErrorKind::bad_input,
                 name + ": not a mesh that is read: binary OFF, expected text"};
  if (!form->has_dimension) return *form;
  const auto dimension = reader.count();
  if (dimension != 3u)
    return off_error(name, reader, "expected 3, the only number of coordinates that is read");
  return *form;
}

}  // namespace

Result<TriangleMesh> parse_off(std::string_view text, const std::string& name) {
  BATON_ASSIGN(const std::string_view plain, without_mark(text, name));
  WordReader reader(plain);
  BATON_ASSIGN(const Form form, read_form(reader, name));

  // The third count, of edges, is optional and without a meaning.
  const auto num_vertices = reader.count();
  const auto num_faces = num_vertices ? reader.count() : std::nullopt;
  if (!num_faces) return off_error(name, reader, "expected the numbers of vertices and faces");
  if (*num_vertices * kMinVertexBytes + *num_faces * kMinFaceBytes > text.size()) {
    return off_error(name, reader,
                     "expected " + std::to_string(*num_vertices) + " vertices and " +
                         std::to_string(*num_faces) +
                         " faces, which the file is too small to hold");
  }
  WordReader next_line = reader;
  next_line.skip_line();
  const bool is_by_line =
      has_a_line_each(next_line, form, std::uint64_t{*num_vertices} + *num_faces);
  if (is_by_line)
    reader = next_line;
  else if (reader.goes_on())
    (void)reader.word();

  Polygons polygons;
  BATON_ASSIGN(polygons.positions, read_vertices(reader, *num_vertices, form, is_by_line, name));
  if (form.has_colors) polygons.unread_colors = polygons.positions.size();
  BATON_TRY(read_faces(reader, *num_faces, is_by_line, name, polygons));
  return mesh_of(polygons, false, false);
}

}  // namespace baton
