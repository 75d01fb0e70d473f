#include "common/scene/gltf/shaper.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/scene/gltf/accessor.h"

namespace baton::gltf {
namespace {

/// Where sums of finite numbers may end up in floats.
constexpr double kFarthest = 1e30;

using Vec = std::array<double, 3>;

Vec at(const std::vector<double>& values, std::size_t vertex) {
  return {values[3 * vertex], values[3 * vertex + 1], values[3 * vertex + 2]};
}

Vec3 to_vec3(const Vec& v) {
  const auto number = [](double x) {
    return std::isfinite(x) ? static_cast<float>(std::clamp(x, -kFarthest, kFarthest)) : 0.0f;
  };
  return {number(v[0]), number(v[1]), number(v[2])};
}

/// The unit vector along `v`; along `otherwise` where that has no length.
Vec3 direction_of(const Vec& v, const Vec3& otherwise) {
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(length > 0) || !std::isfinite(length)) return normalize(otherwise);
  return to_vec3({v[0] / length, v[1] / length, v[2] / length});
}

Vec moved(const Matrix& m, const Vec& p) {
  return {m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3],
          m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7],
          m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11]};
}

Vec turned(const Matrix& m, const Vec& d) {
  return {m[0] * d[0] + m[1] * d[1] + m[2] * d[2], m[4] * d[0] + m[5] * d[1] + m[6] * d[2],
          m[8] * d[0] + m[9] * d[1] + m[10] * d[2]};
}

/// By the inverse transpose, up to a positive factor.
Vec turned_normal(const Matrix& m, const Vec& n) {
  const double sign = determinant(m) < 0 ? -1 : 1;
  const auto cofactor = [&](std::size_t a, std::size_t b, std::size_t c, std::size_t d) {
    return sign * (m[a] * m[d] - m[b] * m[c]);
  };
  const Matrix cofactors{cofactor(5, 6, 9, 10), cofactor(6, 4, 10, 8), cofactor(4, 5, 8, 9), 0,
                         cofactor(9, 10, 1, 2), cofactor(10, 8, 2, 0), cofactor(8, 9, 0, 1), 0,
                         cofactor(1, 2, 5, 6),  cofactor(2, 0, 6, 4),  cofactor(0, 1, 4, 5), 0};
  return turned(cofactors, n);
}

std::vector<double> doubles(const std::vector<float>& values) {
  return {values.begin(), values.end()};
}

}  // namespace

Result<Shaper> Shaper::read(const Document& document, int node, std::size_t primitive,
                            const Vertices& v, bool with_normals, bool with_tangents) {
  Shaper shaper;
  shaper.positions_ = v.positions;
  if (with_normals) shaper.normals_ = v.normals;
  if (with_tangents) shaper.tangents_ = v.tangents;
  const Node& given = document.nodes[static_cast<std::size_t>(node)];
  const Primitive& of = document.mesh_of(given).primitives[primitive];
  const std::string place = place_of(given.mesh, primitive);
  BATON_TRY(shaper.read_targets(document, of, place));
  if (given.skin >= 0) BATON_TRY(shaper.read_skin(document, given.skin, of, place));
  return shaper;
}

Status Shaper::read_targets(const Document& document, const Primitive& given,
                            const std::string& place) {
  const std::size_t count = positions_.size() / 3;
  for (std::size_t t = 0; t < given.targets.size(); ++t) {
    const auto read = [&](int accessor, const char* name, std::vector<Delta>& deltas) -> Status {
      if (accessor < 0) return {};
      BATON_ASSIGN(const std::vector<float> values,
                   read_attribute(document, accessor, 3, count,
                                  fmt::format("{}.targets[{}]", place, t), name));
      for (std::size_t i = 0; i < count; ++i) {
        if (!is_finite(values, 3, i)) {
          ++repairs_.steps;
          continue;
        }
        const std::array<float, 3> step{values[3 * i], values[3 * i + 1], values[3 * i + 2]};
        if (step != std::array<float, 3>{}) deltas.push_back({static_cast<std::uint32_t>(i), step});
      }
      return {};
    };
    Target& target = targets_.emplace_back();
    BATON_TRY(read(given.targets[t].positions, "POSITION", target.positions));
    if (!normals_.empty()) BATON_TRY(read(given.targets[t].normals, "NORMAL", target.normals));
    if (!tangents_.empty()) BATON_TRY(read(given.targets[t].tangents, "TANGENT", target.tangents));
  }
  return {};
}

Status Shaper::read_skin(const Document& document, int skin, const Primitive& given,
                         const std::string& place) {
  const Skin& bones = document.skins[static_cast<std::size_t>(skin)];
  joints_ = bones.joints;
  from_mesh_.assign(joints_.size(), kIdentity);
  holds_.assign(joints_.size(), true);
  if (bones.inverse_binds >= 0) BATON_TRY(read_binds(document, skin));
  return read_joints(document, given, place);
}

/// A joint whose matrix is not finite holds nothing.
Status Shaper::read_binds(const Document& document, int skin) {
  const int accessor = document.skins[static_cast<std::size_t>(skin)].inverse_binds;
  BATON_ASSIGN(const std::vector<float> columns, read_floats(document, accessor, 16));
  if (columns.size() < 16 * joints_.size())
    return document.error(
        fmt::format("$.skins[{}].inverseBindMatrices: expected one for each of {} joints, got {}",
                    skin, joints_.size(), columns.size() / 16));
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    holds_[j] = is_finite(columns, 16, j);
    for (std::size_t i = 0; holds_[j] && i < 12; ++i)
      from_mesh_[j][i] = double{columns[16 * j + i % 4 * 4 + i / 4]};
  }
  return {};
}

Status Shaper::read_joints(const Document& document, const Primitive& given,
                           const std::string& place) {
  const std::size_t count = positions_.size() / 3;
  std::vector<std::vector<float>> joints, weights;
  for (std::size_t s = 0; s < given.joint_sets.size(); ++s) {
    const JointSet& set = given.joint_sets[s];
    const std::string name = fmt::format("JOINTS_{}", s);
    const Accessor& accessor = document.accessors[static_cast<std::size_t>(set.joints)];
    const bool is_whole =
        accessor.component == Component::u8 || accessor.component == Component::u16;
    if (!is_whole || accessor.normalized)
      return document.error(
          fmt::format("{}.{}: expected unsigned bytes or shorts, not normalized", place, name));
    BATON_ASSIGN(auto read, read_attribute(document, set.joints, 4, count, place, name));
    joints.push_back(std::move(read));
    BATON_ASSIGN(
        read, read_attribute(document, set.weights, 4, count, place, fmt::format("WEIGHTS_{}", s)));
    weights.push_back(std::move(read));
  }
  first_.push_back(0);
  for (std::size_t vertex = 0; vertex < count; ++vertex) {
    for (std::size_t s = 0; s < joints.size(); ++s) {
      for (std::size_t i = 4 * vertex; i < 4 * vertex + 4; ++i) {
        const auto joint = static_cast<std::uint32_t>(joints[s][i]);
        const float weight = weights[s][i];
        if (weight == 0) continue;
        if (joint >= joints_.size())
          return document.error(
              fmt::format("{}.JOINTS_{}: expected joints below {}, as the skin has, found {}",
                          place, s, joints_.size(), joint));
        const bool is_sound = weight > 0 && std::isfinite(weight) && holds_[joint];
        is_sound ? influences_.push_back({joint, weight}) : void(++repairs_.holds);
      }
    }
    if (first_.back() == influences_.size()) {
      influences_.push_back({0, 1});
      ++repairs_.weights;
    }
    first_.push_back(influences_.size());
  }
  return {};
}

/// The mean of the joints that move a vertex.
Matrix Shaper::blend(std::span<const Matrix> joints, std::size_t vertex) const {
  Matrix sum{};
  double weights = 0;
  for (std::size_t i = first_[vertex]; i < first_[vertex + 1]; ++i) {
    const double weight = influences_[i].weight;
    const Matrix& joint = joints[influences_[i].joint];
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += weight * joint[k];
    weights += weight;
  }
  for (double& x : sum) x /= weights;
  return sum;
}

MeshShape Shaper::shape(std::span<const Matrix> to_world, std::span<const double> weights) const {
  std::vector<double> p = doubles(positions_), n = doubles(normals_), tangents;
  for (std::size_t i = 0; i < tangents_.size(); ++i) {
    if (i % 4 < 3) tangents.push_back(double{tangents_[i]});
  }
  const auto add = [](const std::vector<Delta>& deltas, double weight,
                      std::vector<double>& values) {
    for (const Delta& delta : deltas) {
      for (std::size_t c = 0; c < 3; ++c)
        values[3 * delta.vertex + c] += weight * double{delta.step[c]};
    }
  };
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    if (weights[t] == 0) continue;
    add(targets_[t].positions, weights[t], p);
    add(targets_[t].normals, weights[t], n);
    add(targets_[t].tangents, weights[t], tangents);
  }

  std::vector<Matrix> joints;
  for (std::size_t j = 0; j < joints_.size(); ++j)
    joints.push_back(multiply(to_world[static_cast<std::size_t>(joints_[j])], from_mesh_[j]));
  const std::size_t count = positions_.size() / 3;
  MeshShape result;
  result.positions.reserve(count);
  result.normals.reserve(n.size() / 3);
  result.tangents.reserve(tangents.size() / 3);
  for (std::size_t i = 0; i < count; ++i) {
    const Matrix m = joints.empty() ? kIdentity : blend(joints, i);
    result.positions.push_back(to_vec3(joints.empty() ? at(p, i) : moved(m, at(p, i))));
    if (!n.empty())
      result.normals.push_back(direction_of(turned_normal(m, at(n, i)), vec3_at(normals_, i)));
    if (!tangents.empty()) {
      const float side = (tangents_[4 * i + 3] < 0) == (determinant(m) < 0) ? 1.0f : -1.0f;
      const Vec3 otherwise{tangents_[4 * i], tangents_[4 * i + 1], tangents_[4 * i + 2]};
      result.tangents.push_back({direction_of(turned(m, at(tangents, i)), otherwise), side});
    }
  }
  return result;
}

std::uint64_t Shaper::size_bytes() const {
  std::uint64_t size = (positions_.size() + normals_.size() + tangents_.size()) * sizeof(float) +
                       from_mesh_.size() * sizeof(Matrix) + first_.size() * sizeof(std::size_t) +
                       influences_.size() * sizeof(Influence);
  for (const Target& target : targets_)
    size +=
        (target.positions.size() + target.normals.size() + target.tangents.size()) * sizeof(Delta);
  return size;
}

}  // namespace baton::gltf
