#include "common/job/motion.h"

#include <algorithm>
#include <cmath>

#include "common/job/job_facts.h"
#include "common/job/key_span.h"
#include "common/math/quaternion.h"

namespace baton {
namespace {

/// Slope of a Catmull-Rom spline at `at`: that of the parabola through it and its neighbours
/// [Catmull & Rom 1974, for uneven keys]; at an end, that of the only side.
template <class K, class V>
Vec3 slope(const std::vector<K>& keys, std::size_t before, std::size_t at, std::size_t after,
           const V& value) {
  const auto chord = [&](std::size_t a, std::size_t b) {
    return (value(keys[b]) - value(keys[a])) / static_cast<float>(keys[b].frame - keys[a].frame);
  };
  if (before == at) return chord(at, after);
  if (after == at) return chord(before, at);
  const double left = keys[at].frame - keys[before].frame;
  const double right = keys[after].frame - keys[at].frame;
  const auto weight = static_cast<float>(right / (left + right));
  return chord(before, at) * weight + chord(at, after) * (1 - weight);
}

/// A value of three numbers between keys.
template <class K, class V>
Vec3 join(const std::vector<K>& keys, const KeySpan& span, KeyCurve curve, const V& value) {
  const Vec3 a = value(keys[span.from]);
  if (span.share <= 0) return a;
  const Vec3 b = value(keys[span.to]);
  const auto t = static_cast<float>(span.share);
  if (curve == KeyCurve::linear) return a * (1 - t) + b * t;
  const auto length = static_cast<float>(keys[span.to].frame - keys[span.from].frame);
  const Vec3 out = slope(keys, span.before, span.from, span.to, value) * length;
  const Vec3 in = slope(keys, span.from, span.to, span.after, value) * length;
  const float t2 = t * t, t3 = t2 * t;
  return a * (2 * t3 - 3 * t2 + 1) + out * (t3 - 2 * t2 + t) + b * (3 * t2 - 2 * t3) +
         in * (t3 - t2);
}

/// Element by element: keys with matrices are dense.
Transform matrix_at(const ObjectKey& from, const ObjectKey& to, double share) {
  const auto t = static_cast<float>(share);
  Matrix34 m = *from.matrix;
  for (std::size_t i = 0; t > 0 && i < m.size(); ++i) m[i] += ((*to.matrix)[i] - m[i]) * t;
  return to_transform(m);
}

/// Curves may swing below 0, but not where a key says that the object is not there.
Vec3 scale_at(const std::vector<ObjectKey>& keys, const KeySpan& span, KeyCurve curve) {
  const Vec3 s = join(keys, span, curve, [](const ObjectKey& key) { return key.scale; });
  const Vec3 &a = keys[span.from].scale, &b = keys[span.to].scale;
  const auto held = [](float from, float to, float between) {
    return from == 0 || to == 0 ? std::max(0.0f, between) : between;
  };
  return {held(a.x, b.x, s.x), held(a.y, b.y, s.y), held(a.z, b.z, s.z)};
}

Mat3 scaling(const Vec3& s) { return {{s.x, 0, 0, 0, s.y, 0, 0, 0, s.z}}; }

}  // namespace

Transform to_transform(const Matrix34& m) {
  return {{{m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}}, {m[3], m[7], m[11]}};
}

bool moves(const ObjectSpec& object) { return !object.keys.empty() || object.gltf.has_value(); }

bool moves(const JobSpec& job) {
  const auto deforms = [&](const ObjectSpec& object) {
    const auto mesh = job.scene.meshes.find(object.mesh);
    return mesh != job.scene.meshes.end() && mesh->second.deforms();
  };
  return !job.camera.keys.empty() || job.camera.gltf.has_value() ||
         std::any_of(job.scene.objects.begin(), job.scene.objects.end(),
                     [&](const ObjectSpec& object) { return moves(object) || deforms(object); });
}

bool is_settled(const JobSpec& job) {
  const bool from_file =
      job.camera.gltf ||
      std::any_of(job.scene.objects.begin(), job.scene.objects.end(),
                  [](const ObjectSpec& object) { return object.gltf.has_value(); });
  const bool in_scene = job.scene.gltf || !job.camera.node.empty();
  return !from_file && !in_scene && (!moves(job) || job.motion.max_px > 0);
}

Status check_settled(const JobSpec& job) {
  if (is_settled(job)) return {};
  return Error{ErrorKind::bad_input,
               "job \"" + job.name +
                   "\": not settled: expected no scene or motion in a glTF file, and "
                   "motion.maxPx above 0"};
}

bool shares_history(const JobSpec& job) { return moves(job) || asks_neighbors(job.sampling); }

std::int32_t history_reach_px(const JobSpec& job) {
  return (moves(job) ? job.motion.max_px : 0) +
         (asks_neighbors(job.sampling) ? job.sampling.neighbor_radius : 0);
}

CameraSpec camera_at(const JobSpec& job, double frame) {
  CameraSpec camera = job.camera;
  camera.keys.clear();
  if (job.camera.keys.empty()) return camera;
  const KeySpan span = find_span(job.camera.keys, frame);
  const auto at = [&](auto value) { return join(job.camera.keys, span, job.motion.curve, value); };
  camera.position = at([](const CameraKey& key) { return key.position; });
  camera.look_at = at([](const CameraKey& key) { return key.look_at; });
  camera.up = at([](const CameraKey& key) { return key.up; });
  camera.vertical_fov_deg =
      at([&](const CameraKey& key) {
        return Vec3{key.vertical_fov_deg.value_or(job.camera.vertical_fov_deg), 0, 0};
      }).x;
  return camera;
}

Transform object_motion_at(const ObjectSpec& object, KeyCurve curve, double frame) {
  if (object.keys.empty()) return {};
  const KeySpan span = find_span(object.keys, frame);
  const auto at = [&](auto value) { return join(object.keys, span, curve, value); };
  if (object.keys[span.from].matrix)
    return matrix_at(object.keys[span.from], object.keys[span.to], span.share);
  const Vec3 degrees = at([](const ObjectKey& key) { return key.rotate_deg; });
  const Mat3 turned = rotation_about({0, 0, 1}, degrees.z) * rotation_about({0, 1, 0}, degrees.y) *
                      rotation_about({1, 0, 0}, degrees.x);
  const Quaternion spin = slerp(to_quaternion(object.keys[span.from].quaternion),
                                to_quaternion(object.keys[span.to].quaternion), span.share);
  return {to_matrix(spin) * turned * scaling(scale_at(object.keys, span, curve)),
          at([](const ObjectKey& key) { return key.translate; })};
}

}  // namespace baton
