#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/mesh/mesh_readers.h"
#include "common/scene/mesh/mesh_text.h"
#include "common/scene/mesh/polygons.h"

namespace baton {
namespace {

constexpr bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

/// The words of a line.
class Words {
 public:
  explicit Words(std::string_view line) : line_(line) {}

  /// Empty at the end.
  std::string_view next() {
    while (!line_.empty() && is_blank(line_.front())) line_.remove_prefix(1);
    std::size_t end = 0;
    while (end < line_.size() && !is_blank(line_[end])) ++end;
    const std::string_view word = line_.substr(0, end);
    line_.remove_prefix(end);
    return word;
  }

 private:
  std::string_view line_;
};

std::optional<std::int64_t> whole_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Begin a curve or a surface of a formula.
constexpr std::string_view kFormulas[] = {"curv", "surf", "cdc", "cdp", "bsp", "bzp"};
/// Say nothing of triangles: groups, names, materials, smoothing, and what belongs to formulas.
constexpr std::string_view kOfNoFace[] = {
    "g",     "o",    "s",     "mg",         "usemtl",    "mtllib", "usemap", "maplib",
    "bevel", "lod",  "ctech", "c_interp",   "d_interp",  "stech",  "vp",     "cstype",
    "deg",   "bmat", "step",  "shadow_obj", "trace_obj", "curv2",  "parm",   "trim",
    "hole",  "scrv", "sp",    "end",        "con",       "res"};

/// How long a list must be for the faces that name its entries.
struct Needed {
  std::int64_t count = 0;
  int line = 0;  ///< of the face that needs the last one
};

/// Reads one file.
class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  Result<Polygons> read() {
    std::string joined;
    while (!text_.empty()) {
      std::string_view line = take_line();
      // A line goes on behind a backslash.
      joined.clear();
      while (line.ends_with('\\') && !text_.empty()) {
        joined += line.substr(0, line.size() - 1);
        joined += ' ';
        line = take_line();
      }
      if (!joined.empty()) line = joined += line;
      std::size_t end = 0;
      while (end < line.size() && !is_comment(line, end)) ++end;
      BATON_TRY(read_line(line.substr(0, end)));
    }
    if (polygons_.positions.empty()) return fail("not a mesh: no vertices (lines \"v x y z\")");
    BATON_TRY(check(needed_positions_, polygons_.positions.size(), "vertices"));
    BATON_TRY(check(needed_uvs_, polygons_.uvs.size(), "texture coordinates"));
    BATON_TRY(check(needed_normals_, polygons_.normals.size(), "normals"));
    if (!any_normal_) polygons_.corner_normals.clear();
    if (!any_uv_) polygons_.corner_uvs.clear();
    if (!any_normal_) polygons_.normals.clear();
    if (!any_uv_) polygons_.uvs.clear();
    return std::move(polygons_);
  }

 private:
  std::string_view take_line() {
    const LineEnd end = find_line_end(text_);
    const std::string_view line = text_.substr(0, end.length);
    text_.remove_prefix(end.next);
    ++line_number_;
    return line;
  }
  Error fail(const std::string& what) const { return {ErrorKind::bad_input, name_ + ": " + what}; }
  Error bad_line(const std::string& what) const { return bad_line(line_number_, what); }
  Error bad_line(int line, const std::string& what) const {
    return fail("not a mesh: line " + std::to_string(line) + ": " + what);
  }
  /// Faces may come before what they name.
  Status check(const Needed& needed, std::size_t count, const std::string& what) const {
    if (needed.count <= static_cast<std::int64_t>(count)) return {};
    return bad_line(needed.line, "expected " + what + " from 1 to " + std::to_string(count) +
                                     ", which the file has, got " + std::to_string(needed.count));
  }

  Status read_line(std::string_view line) {
    Words words(line);
    const std::string_view keyword = words.next();
    if (keyword == "v") return read_vertex(words);
    if (keyword == "vn") return read_normal(words);
    if (keyword == "vt") return read_uv(words);
    if (keyword == "f" || keyword == "fo") return read_face(words);
    const auto is_of = [&](const auto& words_of) {
      return std::ranges::find(words_of, keyword) != std::end(words_of);
    };
    if (keyword == "l" || keyword == "p") {
      ++polygons_.lines;
    } else if (is_of(kFormulas)) {
      ++polygons_.formulas;
    } else if (!keyword.empty() && !is_of(kOfNoFace)) {
      ++polygons_.unread_lines;
    }
    return {};
  }

  template <std::size_t N>
  std::optional<std::array<double, N>> numbers(Words& words, std::size_t least) const {
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i) {
      const std::string_view word = words.next();
      if (word.empty() && i >= least) break;
      const auto value = real_number(word);
      if (!value) return std::nullopt;
      values[i] = *value;
    }
    return values;
  }

  Status read_vertex(Words& words) {
    const auto p = numbers<3>(words, 3);
    if (!p) return bad_line("expected three coordinates of a vertex");
    polygons_.positions.push_back(*p);
    // Behind a weight, or without it, some programs write a colour.
    std::size_t more = 0;
    while (!words.next().empty()) ++more;
    polygons_.unread_colors += more >= 3 ? 1 : 0;
    return {};
  }
  Status read_normal(Words& words) {
    const auto n = numbers<3>(words, 3);
    if (!n) return bad_line("expected three numbers of a normal");
    polygons_.normals.push_back(
        {static_cast<float>((*n)[0]), static_cast<float>((*n)[1]), static_cast<float>((*n)[2])});
    return {};
  }
  Status read_uv(Words& words) {
    const auto uv = numbers<2>(words, 1);
    if (!uv) return bad_line("expected two numbers of texture coordinates");
    // In these files v grows upward.
    polygons_.uvs.push_back({static_cast<float>((*uv)[0]), 1 - static_cast<float>((*uv)[1])});
    return {};
  }

  /// Corners are "position/uv/normal", counted from 1, or back from the end.
  Status read_face(Words& words) {
    std::uint32_t size = 0;
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
      std::array<std::string_view, 3> parts{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t end = std::min(word.find('/'), word.size());
        parts[k] = word.substr(0, end);
        word.remove_prefix(std::min(end + 1, word.size()));
      }
      const auto position = index(parts[0], polygons_.positions.size(), needed_positions_);
      const auto uv = index(parts[1], polygons_.uvs.size(), needed_uvs_);
      const auto normal = index(parts[2], polygons_.normals.size(), needed_normals_);
      if (!position || *position == Polygons::kNone || !uv || !normal)
        return bad_line("expected corners of vertices, counted from 1 or back from -1 = vertex " +
                        std::to_string(polygons_.positions.size()));
      polygons_.corners.push_back(*position);
      polygons_.corner_uvs.push_back(*uv);
      polygons_.corner_normals.push_back(*normal);
      any_uv_ = any_uv_ || *uv != Polygons::kNone;
      any_normal_ = any_normal_ || *normal != Polygons::kNone;
      ++size;
    }
    polygons_.sizes.push_back(size);
    polygons_.lines += size < 3 ? 1 : 0;
    return {};
  }

  /// A place in a list, so far of `count` entries; kNone where nothing stands or 0; nullopt: cannot
  /// be there.
  std::optional<std::uint32_t> index(std::string_view word, std::size_t count,
                                     Needed& needed) const {
    if (word.empty()) return Polygons::kNone;
    const auto given = whole_number(word);
    if (!given) return std::nullopt;
    if (*given == 0) return Polygons::kNone;
    const std::int64_t at = *given > 0 ? *given - 1 : static_cast<std::int64_t>(count) + *given;
    if (at < 0 || at >= std::int64_t{Polygons::kNone}) return std::nullopt;
    if (at >= needed.count) needed = {at + 1, line_number_};
    return static_cast<std::uint32_t>(at);
  }

  std::string_view text_;
  const std::string& name_;
  int line_number_ = 0;
  Polygons polygons_;
  Needed needed_positions_, needed_uvs_, needed_normals_;
  bool any_normal_ = false, any_uv_ = false;
};

}  // namespace

Result<TriangleMesh> parse_obj(std::string_view text, const std::string& name, bool with_normals,
                               bool with_uvs) {
  BATON_ASSIGN(const std::string_view plain, without_mark(text, name));
  BATON_ASSIGN(const Polygons polygons, ObjReader(plain, name).read());
  return mesh_of(polygons, with_normals, with_uvs);
}

}  // namespace baton
