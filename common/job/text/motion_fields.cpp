#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <string>

#include "common/base/limits.h"
#include "common/job/text/job_fields.h"

namespace baton {
namespace {

constexpr std::array<std::string_view, 2> kProjections{"perspective", "orthographic"};
constexpr double kMaxLength = 1e9, kMaxShift = 100;
constexpr NumberRange kLengthRange{.min = 0, .max = kMaxLength, .min_open = true};
constexpr NumberRange kFovRange{.min = 0, .max = 180, .min_open = true, .max_open = true};

/// The three vectors must span a view.
void check_view(JobArchive& a, const Vec3& position, const Vec3& look_at, const Vec3& up) {
  const Vec3 view = look_at - position;
  if (!(length(view) > 0)) {
    a.fault("lookAt", "another point than position", "the same");
  } else if (!(length(up) > 0)) {
    a.fault("up", "a direction", "[0, 0, 0]");
  } else if (length(cross(normalize(view), normalize(up))) < 1e-4f) {
    a.fault("up", "a direction across the view from position to lookAt", "one along it");
  }
}

/// up: of a key that has none.
void fields(JobArchive& a, CameraKey& key, const Vec3& up) {
  a.number(required("frame"), key.frame, kPoseRange);
  a.vector(required("position"), key.position, kCoordinateRange);
  a.vector(required("lookAt"), key.look_at, kCoordinateRange);
  if (!a.vector("up", key.up, kCoordinateRange)) key.up = up;
  a.number("verticalFovDeg", key.vertical_fov_deg, kFovRange);
  check_view(a, key.position, key.look_at, key.up);
}

void fields(JobArchive& a, ObjectKey& key) {
  a.number(required("frame"), key.frame, kPoseRange);
  a.vector("translate", key.translate, kCoordinateRange);
  a.vector("rotateDeg", key.rotate_deg, kAngleRange);
  std::array<double, 4> quaternion{key.quaternion[0], key.quaternion[1], key.quaternion[2],
                                   key.quaternion[3]};
  if (a.numbers("quaternion", quaternion, {-1, 1}, false)) {
    for (std::size_t i = 0; i < 4; ++i) key.quaternion[i] = static_cast<float>(quaternion[i]);
    if (key.quaternion == std::array<float, 4>{})
      a.fault("quaternion", "a rotation", "[0, 0, 0, 0]");
  }
  a.vector("scale", key.scale, kFactorRange, true);
  matrix_field(a, "matrix", key.matrix);
}

void fields(JobArchive& a, GltfMotion& gltf) {
  asset_path(a, required("file"), gltf.file, {".gltf", ".glb"});
  a.text(required("node"), gltf.node);
  a.number("fps", gltf.fps, kPositiveRange);
  a.integer("startFrame", gltf.start_frame, 0, limits::kMaxFrameNumber);
  a.text(alternative("animation"), gltf.animation);
}

void gltf_field(JobArchive& a, std::optional<GltfMotion>& gltf) {
  GltfMotion source = gltf.value_or(GltfMotion{});
  if (a.object("gltf", [&] { fields(a, source); }, {.present = gltf.has_value()})) gltf = source;
}

/// Keys, where no file says how things move. more: what a key takes from its owner.
template <class K, class... More>
void key_fields(JobArchive& a, std::vector<K>& keys, const std::optional<GltfMotion>& gltf,
                const More&... more) {
  a.list("keys", keys, limits::kMaxKeys, [&](K& key) { fields(a, key, more...); });
  check_ascending(a, "keys", keys);
  if (gltf && !keys.empty()) a.fault("gltf", "either keys or gltf", "both");
}

/// Where the camera is, and how much it sees.
void view_fields(JobArchive& a, CameraSpec& camera) {
  a.vector("position", camera.position, kCoordinateRange);
  a.vector("lookAt", camera.look_at, kCoordinateRange);
  a.vector("up", camera.up, kCoordinateRange);
  a.number("verticalFovDeg", camera.vertical_fov_deg, kFovRange);
  check_view(a, camera.position, camera.look_at, camera.up);
  a.choice("projection", camera.projection, kProjections);
  a.number("orthographicHeight", camera.orthographic_height, kLengthRange);
}

/// Fields of the view of a camera of a file, which says where it is.
void own_view_fields(JobArchive& a, CameraSpec& camera) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();  // which is not written
  for (const char* const key : {"position", "lookAt", "up"}) {
    Vec3 given{kNone, kNone, kNone};
    if (a.vector(alternative(key), given, kCoordinateRange))
      a.fault(key, "none, as the glTF file says where its camera is", "a place or direction");
  }
  a.number(alternative("verticalFovDeg"), camera.own_vertical_fov_deg, kFovRange);
  a.number(alternative("orthographicHeight"), camera.own_orthographic_height, kLengthRange);
  if (camera.own_vertical_fov_deg && camera.own_orthographic_height)
    a.fault("orthographicHeight", "either it or verticalFovDeg in place of what the file says",
            "both");
  std::string projection;
  if (!a.word(alternative("projection"), projection, kProjections)) return;
  if (projection == kProjections[0] && !camera.own_vertical_fov_deg)
    a.fault("projection", "verticalFovDeg beside it, in place of what the file says", "none");
  if (projection == kProjections[1] && !camera.own_orthographic_height)
    a.fault("projection", "orthographicHeight beside it, in place of what the file says", "none");
}

}  // namespace

void fields(JobArchive& a, CameraSpec& camera) {
  gltf_field(a, camera.gltf);
  a.text(alternative("node"), camera.node);
  const bool is_of_file = camera.gltf || !camera.node.empty();
  is_of_file ? own_view_fields(a, camera) : view_fields(a, camera);
  std::array<double, 2> shift{camera.shift[0], camera.shift[1]};
  if (a.numbers("shift", shift, {-kMaxShift, kMaxShift}, false))
    camera.shift = {static_cast<float>(shift[0]), static_cast<float>(shift[1])};
  a.number("aperture", camera.aperture, {0, kMaxLength});
  a.number("focusDistance", camera.focus_distance, {0, kMaxLength});
  key_fields(a, camera.keys, camera.gltf, camera.up);
  if (!camera.node.empty() && (camera.gltf || !camera.keys.empty()))
    a.fault("node", "either node, keys or gltf", "several");
}

void motion_fields(JobArchive& a, ObjectSpec& object) {
  gltf_field(a, object.gltf);
  key_fields(a, object.keys, object.gltf);
  const auto has_matrix = [](const ObjectKey& key) { return key.matrix.has_value(); };
  const auto count = std::count_if(object.keys.begin(), object.keys.end(), has_matrix);
  if (count != 0 && count != std::ssize(object.keys))
    a.fault("keys", "a matrix in all keys or in none", fmt::format("one in {}", count));
}

void fields(JobArchive& a, MotionSpec& motion) {
  a.choice("curve", motion.curve, kKeyCurves);
  a.integer("maxPx", motion.max_px, 0, limits::kMaxImageSide);
  a.number("depthTolerance", motion.depth_tolerance, {.min = 0, .max = 1, .min_open = true});
  a.number("normalToleranceDeg", motion.normal_tolerance_deg, {0, 180});
}

}  // namespace baton
