#include "common/scene/mesh/polygons.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/scene/mesh/mesh_builder.h"

namespace baton {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Point = std::array<double, 2>;

/// Faces with more corners that are no fans are cut as if they were: ears take the square of them.
constexpr std::size_t kMostEarCorners = 4096;
/// Corners farther from the plane of a face than this share of its size bend it.
constexpr double kBent = 1e-6;
/// A mesh farther from the origin than so many times its size has one of its own: float32 leaves
/// its positions fewer than 16 bits there.
constexpr double kFarAway = 256;

Position minus(const Position& a, const Position& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Position cross(const Position& a, const Position& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Position& a, const Position& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Position& a) { return std::sqrt(dot(a, a)); }

/// Twice the area, along the normal [Newell].
Position area_vector(std::span<const Position> corners) {
  Position sum{};
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const Position area = cross(minus(corners[i - 1], corners[0]), minus(corners[i], corners[0]));
    for (std::size_t c = 0; c < 3; ++c) sum[c] += area[c];
  }
  return sum;
}

/// All triangles around the first corner turn as the whole does.
bool is_fan(std::span<const Position> corners, const Position& normal) {
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const Position area = cross(minus(corners[i - 1], corners[0]), minus(corners[i], corners[0]));
    if (dot(area, normal) < 0) return false;
  }
  return true;
}

/// The second diagonal of a quadrilateral that is bent and convex, where it is the shorter one.
bool takes_other_diagonal(std::span<const Position> q, const Position& normal) {
  if (q.size() != 4) return false;
  const Position first = minus(q[2], q[0]), second = minus(q[3], q[1]);
  const double height =
      std::fabs(dot(minus(q[1], q[0]), normal)) / std::max(length(normal), 1e-300);
  const double out = std::fabs(dot(cross(first, second), minus(q[1], q[0])));
  const double size = std::max(length(first), length(second));
  if (!(out > kBent * size * size * size) && !(height > kBent * size)) return false;
  const std::array<Position, 4> turned{q[1], q[2], q[3], q[0]};
  return length(second) < length(first) && is_fan(turned, normal);
}

/// Twice the area of a triangle, positive where it turns against the clock.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// Seen along the normal's longest axis.
std::vector<Point> flattened(std::span<const Position> corners, const Position& normal) {
  std::size_t away = 0;
  for (std::size_t c = 1; c < 3; ++c)
    if (std::fabs(normal[c]) > std::fabs(normal[away])) away = c;
  std::size_t x = (away + 1) % 3, y = (away + 2) % 3;
  if (normal[away] < 0) std::swap(x, y);
  std::vector<Point> flat;
  for (const Position& corner : corners)
    flat.push_back({corner[x] - corners[0][x], corner[y] - corners[0][y]});
  return flat;
}

/// Cuts ears off a polygon that turns against the clock.
class EarCutter {
 public:
  explicit EarCutter(std::vector<Point> points)
      : points_(std::move(points)), left_(points_.size()) {
    std::iota(left_.begin(), left_.end(), 0u);
  }

  std::vector<Triangle> cut(bool& is_simple) {
    while (left_.size() > 3) {
      // A way there and back has no area.
      if (const std::size_t tip = find([&](std::size_t i) { return is_tip(i); });
          tip != left_.size()) {
        left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(tip));
        continue;
      }
      std::size_t ear = find([&](std::size_t i) { return is_ear(i); });
      // Corners on a line with their neighbours have nothing to cut.
      if (ear == left_.size()) ear = find([&](std::size_t i) { return corner_turn(i) == 0; });
      if (ear == left_.size()) {
        is_simple = false;
        for (std::size_t i = 2; i < left_.size(); ++i)
          triangles_.push_back({left_[0], left_[i - 1], left_[i]});
        return triangles_;
      }
      triangles_.push_back({before(ear), left_[ear], after(ear)});
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    // All ears turn with the polygon: what is left does not where one was none.
    is_simple = is_simple && corner_turn(1) >= 0;
    triangles_.push_back({left_[0], left_[1], left_[2]});
    return triangles_;
  }

 private:
  template <class Is>
  std::size_t find(const Is& is) const {
    std::size_t i = 0;
    while (i < left_.size() && !is(i)) ++i;
    return i;
  }
  std::uint32_t before(std::size_t i) const { return left_[(i + left_.size() - 1) % left_.size()]; }
  std::uint32_t after(std::size_t i) const { return left_[(i + 1) % left_.size()]; }
  double corner_turn(std::size_t i) const {
    return turn(points_[before(i)], points_[left_[i]], points_[after(i)]);
  }
  /// Both neighbours lie in one direction, or one at the corner itself.
  bool is_tip(std::size_t i) const {
    const Point &a = points_[before(i)], &b = points_[left_[i]], &c = points_[after(i)];
    const double along = (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]);
    return turn(a, b, c) == 0 && along >= 0;
  }
  /// No other corner is in the triangle; those at its corners, as of a cut to a hole or where the
  /// outline touches itself, may be, if no edge of theirs leads into it.
  bool is_ear(std::size_t i) const {
    if (!(corner_turn(i) > 0)) return false;
    const std::array<std::uint32_t, 3> ear{before(i), left_[i], after(i)};
    const Point &a = points_[ear[0]], &b = points_[ear[1]], &c = points_[ear[2]];
    for (std::size_t k = 0; k < left_.size(); ++k) {
      const Point& p = points_[left_[k]];
      if (std::ranges::find(ear, left_[k]) != ear.end()) continue;
      const bool is_inside = p == a   ? leads_between(k, a, b, c)
                             : p == b ? leads_between(k, b, c, a)
                             : p == c
                                 ? leads_between(k, c, a, b)
                                 : turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0;
      if (is_inside) return false;
    }
    return true;
  }
  /// Whether an edge at corner k, which is at `tip`, leads between the directions from there to
  /// `right` and to `left`.
  bool leads_between(std::size_t k, const Point& tip, const Point& right, const Point& left) const {
    return std::ranges::any_of(std::array{before(k), after(k)}, [&](std::uint32_t neighbor) {
      const Point& p = points_[neighbor];
      return turn(tip, right, p) > 0 && turn(tip, p, left) > 0;
    });
  }

  const std::vector<Point> points_;
  std::vector<std::uint32_t> left_;
  std::vector<Triangle> triangles_;
};

/// Whether a place is finite in float.
bool is_somewhere(const Position& p) {
  return std::ranges::all_of(p, [](double c) { return std::isfinite(static_cast<float>(c)); });
}

/// The middle of positions that are far away, else 0.
Position own_origin(const std::vector<Position>& positions) {
  const auto first = std::ranges::find_if(positions, is_somewhere);
  if (first == positions.end()) return {};
  Position low = *first, high = *first;
  for (const Position& p : positions) {
    if (!is_somewhere(p)) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      low[c] = std::min(low[c], p[c]);
      high[c] = std::max(high[c], p[c]);
    }
  }
  double farthest = 0, size = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    farthest = std::max({farthest, std::fabs(low[c]), std::fabs(high[c])});
    size = std::max(size, high[c] - low[c]);
  }
  if (!(farthest > kFarAway * size)) return {};
  return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
}

constexpr Uv kNoUv{std::numeric_limits<float>::quiet_NaN(), 0};

/// Puts faces into a mesh.
class FaceTaker {
 public:
  FaceTaker(const Polygons& polygons, bool with_normals, bool with_uvs)
      : polygons_(polygons),
        origin_(own_origin(polygons.positions)),
        has_own_normals_(with_normals && !polygons.corner_normals.empty()),
        has_own_uvs_(with_uvs && !polygons.corner_uvs.empty()),
        parts_{.normals = with_normals && !polygons.normals.empty(),
               .uv_sets = with_uvs && !polygons.uvs.empty() ? 1 : 0,
               .tangents = false,
               .colors = !polygons.colors.empty()},
        builder_(parts_) {}

  TriangleMesh take() {
    // Where normals or coordinates have indices of their own, each corner is a vertex.
    const bool by_position = !has_own_normals_ && !has_own_uvs_;
    builder_.begin_part(by_position ? polygons_.positions.size() : polygons_.corners.size());
    std::vector<Position> face;
    std::size_t first = 0;
    for (const std::uint32_t size : polygons_.sizes) {
      face.clear();
      for (std::size_t k = first; k < first + size; ++k)
        face.push_back(polygons_.positions[polygons_.corners[k]]);
      if (std::ranges::all_of(face, is_somewhere)) {
        bool is_simple = true;
        for (const Triangle& t : triangulate(face, is_simple)) add(first, t, by_position);
        crossing_ += is_simple ? 0 : 1;
      } else {
        ++nowhere_;
      }
      first += size;
    }
    TriangleMesh mesh = builder_.take();
    mesh.origin = origin_;
    mesh.repairs.nowhere = nowhere_;
    mesh.repairs.uvs = without_uv_;
    mesh.repairs.crossing = crossing_;
    mesh.repairs.lines = polygons_.lines;
    mesh.repairs.colors = polygons_.bad_colors;
    mesh.repairs.unread_colors = polygons_.unread_colors;
    mesh.repairs.formulas = polygons_.formulas;
    mesh.repairs.unread_lines = polygons_.unread_lines;
    return mesh;
  }

 private:
  void add(std::size_t first, const Triangle& t, bool by_position) {
    std::array<std::uint32_t, 3> vertices{};
    std::array<Vec3, 3> positions, normals;
    std::array<UvSets, 3> uvs{};
    std::array<VertexColor, 3> colors{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t corner = first + t[k];
      const std::uint32_t at = polygons_.corners[corner];
      vertices[k] = by_position ? at : static_cast<std::uint32_t>(corner);
      const Position& p = polygons_.positions[at];
      positions[k] = {static_cast<float>(p[0] - origin_[0]), static_cast<float>(p[1] - origin_[1]),
                      static_cast<float>(p[2] - origin_[2])};
      if (parts_.colors) colors[k] = polygons_.colors[at];
      if (parts_.normals) {
        const std::uint32_t n = has_own_normals_ ? polygons_.corner_normals[corner] : at;
        const Vec3 normal = n == Polygons::kNone ? Vec3{} : polygons_.normals[n];
        normals[k] = is_direction(normal) ? normalize(normal) : Vec3{};
      }
      if (parts_.uv_sets == 0) continue;
      const std::uint32_t uv = has_own_uvs_ ? polygons_.corner_uvs[corner] : at;
      const Uv place = uv == Polygons::kNone ? kNoUv : polygons_.uvs[uv];
      const bool is_sound = std::isfinite(place[0]) && std::isfinite(place[1]);
      without_uv_ += is_sound ? 0 : 1;
      uvs[k][0] = is_sound ? place : Uv{};
    }
    builder_.add(vertices, positions, normals, uvs, {}, colors);
  }

  const Polygons& polygons_;
  const Position origin_;
  const bool has_own_normals_, has_own_uvs_;
  const MeshParts parts_;
  MeshBuilder builder_;
  std::uint64_t without_uv_ = 0, crossing_ = 0, nowhere_ = 0;
};

}  // namespace

std::vector<Triangle> triangulate(std::span<const Position> corners, bool& is_simple) {
  const auto count = static_cast<std::uint32_t>(corners.size());
  std::vector<Triangle> fan;
  for (std::uint32_t i = 2; i < count; ++i) fan.push_back({0, i - 1, i});
  if (count <= 3) return fan;
  const Position normal = area_vector(corners);
  double areas = 0;
  for (const Triangle& t : fan)
    areas += length(cross(minus(corners[t[1]], corners[0]), minus(corners[t[2]], corners[0])));
  // Parts that turn either way cancel each other.
  if (length(normal) < kBent * areas) {
    is_simple = false;
    return fan;
  }
  if (is_fan(corners, normal)) {
    if (takes_other_diagonal(corners, normal)) return {{0, 1, 3}, {1, 2, 3}};
    return fan;
  }
  if (corners.size() > kMostEarCorners) {
    is_simple = false;
    return fan;
  }
  return EarCutter(flattened(corners, normal)).cut(is_simple);
}

TriangleMesh mesh_of(const Polygons& polygons, bool with_normals, bool with_uvs) {
  return FaceTaker(polygons, with_normals, with_uvs).take();
}

}  // namespace baton
