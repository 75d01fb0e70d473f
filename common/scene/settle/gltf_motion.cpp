#include "common/scene/settle/gltf_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "common/base/limits.h"

namespace baton {
namespace {

/// The file, and the node of it that must move.
Result<std::pair<gltf::NodeMotion, int>> open_moving(const GltfMotion& given,
                                                     std::vector<std::string>& left_out) {
  BATON_ASSIGN(auto document, gltf::read_document(given.file));
  BATON_ASSIGN(gltf::NodeMotion motion,
               gltf::NodeMotion::read(std::move(document), given.animation));
  add_notes(motion, left_out);
  BATON_ASSIGN(const int node, motion.find(given.node));
  if (!motion.moves(node))
    return motion.document().error(fmt::format(
        "node \"{}\": {} moves it or a node above it", given.node,
        given.animation.empty() ? "no animation"
                                : fmt::format("nothing of animation \"{}\"", given.animation)));
  return std::pair(std::move(motion), node);
}

/// Within so many units of the origin a point one unit ahead says which way a camera looks.
constexpr float kNearby = 64;

/// How far ahead a camera looks, as far as it is from the origin: float32 leaves its direction 23
/// bits there.
float look_distance(const Vec3& position) {
  const float farthest =
      std::max({std::fabs(position.x), std::fabs(position.y), std::fabs(position.z)});
  return farthest <= kNearby ? 1 : std::exp2(std::ceil(std::log2(farthest)));
}

/// A camera of glTF looks along -z of its node, y up.
CameraKey camera_key(double frame, const gltf::Matrix& to_world) {
  const Transform map = gltf::to_transform(to_world);
  return {
      .frame = frame,
      .position = map.offset,
      .look_at = map.offset + normalize(map.linear * Vec3{0, 0, -1}) * look_distance(map.offset),
      .up = normalize(map.linear * Vec3{0, 1, 0}),
      .vertical_fov_deg = {}};
}

}  // namespace

KeyFrames key_frames(const gltf::NodeMotion& motion, const FileClock& clock,
                     const std::vector<FrameNumber>& frames, std::size_t most) {
  std::set<FrameNumber> numbers;
  for (const FrameNumber frame : frames) numbers.insert({frame - 1, frame, frame + 1});
  KeyFrames keys;
  if (const auto seconds = motion.seconds()) {
    const auto frame_at = [&](double at) {
      return std::clamp(clock.frame_at(at), -1.0, limits::kMaxFrameNumber + 1.0);
    };
    const auto first = static_cast<int>(std::floor(frame_at((*seconds)[0])));
    const auto last = static_cast<int>(std::ceil(frame_at((*seconds)[1])));
    keys.whole = static_cast<std::size_t>(last - first) < most;
    for (int number = first; keys.whole && number <= last; ++number) numbers.emplace(number);
  }
  keys.frames.assign(numbers.begin(), numbers.end());
  return keys;
}

Status put_camera(const gltf::NodeMotion& motion, int node, const FileClock& clock,
                  const std::vector<FrameNumber>& frames, CameraSpec& camera) {
  const gltf::Document& file = motion.document();
  const gltf::Node& given = file.nodes[static_cast<std::size_t>(node)];
  if (given.camera < 0) return file.error(fmt::format("node \"{}\" holds no camera", given.name));
  const gltf::Camera& lens = file.cameras[static_cast<std::size_t>(given.camera)];

  // The file says nothing of shift and lens: the job does. What it sees, both may say.
  const CameraSpec wanted = camera;
  camera = {};
  camera.shift = wanted.shift;
  camera.aperture = wanted.aperture;
  camera.focus_distance = wanted.focus_distance;
  if (wanted.own_vertical_fov_deg) {
    camera.vertical_fov_deg = *wanted.own_vertical_fov_deg;
  } else if (lens.perspective && !wanted.own_orthographic_height) {
    camera.vertical_fov_deg = static_cast<float>(lens.yfov * 180 / 3.14159265358979323846);
  } else {
    camera.projection = Projection::orthographic;
    camera.orthographic_height =
        wanted.own_orthographic_height.value_or(static_cast<float>(2 * lens.ymag));
  }
  // A lens is sharp one unit ahead unless the job says it.
  if (camera.aperture > 0 && camera.focus_distance == 0) camera.focus_distance = 1;
  const auto at = [&](FrameNumber frame) {
    const std::vector<gltf::Matrix> world = motion.to_world(clock.seconds_at(frame.value()));
    return camera_key(frame.value(), world[static_cast<std::size_t>(node)]);
  };
  if (motion.moves(node)) {
    for (const FrameNumber frame : key_frames(motion, clock, frames, limits::kMaxFrames).frames)
      camera.keys.push_back(at(frame));
    return {};
  }
  const CameraKey rest = at(frames.front());
  camera.position = rest.position;
  camera.look_at = rest.look_at;
  camera.up = rest.up;
  return {};
}

std::vector<ObjectKey> matrix_keys(const std::vector<FrameNumber>& frames,
                                   const std::vector<Matrix34>& matrices) {
  std::vector<ObjectKey> keys;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const bool inner = i > 0 && i + 1 < frames.size();
    if (inner && matrices[i] == matrices[i - 1] && matrices[i] == matrices[i + 1]) continue;
    ObjectKey key;
    key.frame = frames[i].value();
    key.matrix = matrices[i];
    keys.push_back(key);
  }
  return keys;
}

void add_notes(const gltf::NodeMotion& motion, std::vector<std::string>& left_out) {
  for (const std::string& note : motion.notes()) {
    std::string line = motion.document().path + ": " + note;
    if (std::ranges::find(left_out, line) == left_out.end()) left_out.push_back(std::move(line));
  }
}

Status take_camera_keys(const std::vector<FrameNumber>& frames, CameraSpec& camera,
                        std::vector<std::string>& left_out) {
  const GltfMotion gltf = *camera.gltf;
  BATON_ASSIGN(const auto opened, open_moving(gltf, left_out));
  return put_camera(opened.first, opened.second, {gltf.fps, gltf.start_frame}, frames, camera);
}

Status take_object_keys(const std::vector<FrameNumber>& frames, ObjectSpec& object,
                        std::vector<std::string>& left_out) {
  const GltfMotion gltf = *object.gltf;
  BATON_ASSIGN(const auto opened, open_moving(gltf, left_out));
  const FileClock clock{gltf.fps, gltf.start_frame};
  std::vector<Matrix34> matrices;
  const KeyFrames keys = key_frames(opened.first, clock, frames, limits::kMaxFrames);
  for (const FrameNumber frame : keys.frames)
    matrices.push_back(gltf::to_floats(opened.first.to_world(
        clock.seconds_at(frame.value()))[static_cast<std::size_t>(opened.second)]));
  object.keys = matrix_keys(keys.frames, matrices);
  object.gltf.reset();
  return {};
}

}  // namespace baton
