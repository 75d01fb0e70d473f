#include "worker/scene/gltf_motion.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "worker/scene/assimp_file.h"

namespace baton {
namespace {

Error bad_file(const GltfMotion& gltf, const std::string& what) {
  return {ErrorKind::bad_input, gltf.file + ": " + what};
}

Vec3 to_vec3(const aiVector3D& v) { return {v.x, v.y, v.z}; }

/// Value of a channel at a time in ticks, joined linearly (rotations: slerp), held at the ends.
template <class K, class V>
V channel_value(const K* keys, unsigned count, double ticks, const V& rest) {
  if (count == 0) return rest;
  const K* const next = std::upper_bound(keys, keys + count, ticks,
                                         [](double t, const K& key) { return t < key.mTime; });
  if (next == keys) return keys[0].mValue;
  if (next == keys + count) return keys[count - 1].mValue;
  const K& from = next[-1];
  const auto share = static_cast<float>((ticks - from.mTime) / (next->mTime - from.mTime));
  if constexpr (std::is_same_v<V, aiQuaternion>) {
    aiQuaternion turned;
    aiQuaternion::Interpolate(turned, from.mValue, next->mValue, share);
    return turned;
  } else {
    return from.mValue + (next->mValue - from.mValue) * share;
  }
}

/// A glTF file, held open while its animation is read.
class AnimatedFile {
 public:
  static Result<AnimatedFile> open(const GltfMotion& gltf) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(gltf.file, error))
      return bad_file(gltf, "missing: expected a glTF file");
    BATON_ASSIGN(AssimpFile read, AssimpFile::read(gltf.file, "a glTF file"));
    AnimatedFile file(std::move(read));
    file.scene_ = &file.file_.scene();
    file.node_ = file.scene_->mRootNode->FindNode(aiString(gltf.node));
    if (file.node_ == nullptr) return bad_file(gltf, "no node \"" + gltf.node + "\"");
    return file;
  }

  /// The camera of the node, or null.
  const aiCamera* camera() const {
    const auto end = scene_->mCameras + scene_->mNumCameras;
    const auto found = std::find_if(scene_->mCameras, end,
                                    [this](const aiCamera* c) { return c->mName == node_->mName; });
    return found == end ? nullptr : *found;
  }

  /// From the node to the world of the file.
  aiMatrix4x4 to_world(double seconds) const {
    aiMatrix4x4 result;
    for (const aiNode* node = node_; node != nullptr; node = node->mParent)
      result = local(*node, seconds) * result;
    return result;
  }

 private:
  explicit AnimatedFile(AssimpFile file) : file_(std::move(file)) {}

  aiMatrix4x4 local(const aiNode& node, double seconds) const {
    if (scene_->mNumAnimations == 0) return node.mTransformation;
    const aiAnimation& animation = *scene_->mAnimations[0];
    const auto end = animation.mChannels + animation.mNumChannels;
    const auto found = std::find_if(
        animation.mChannels, end, [&](const aiNodeAnim* c) { return c->mNodeName == node.mName; });
    if (found == end) return node.mTransformation;

    // What the channel says nothing about stays as in the file.
    aiVector3D scale, place;
    aiQuaternion rotation;
    node.mTransformation.Decompose(scale, rotation, place);
    const aiNodeAnim& c = **found;
    const double ticks = seconds * (animation.mTicksPerSecond > 0 ? animation.mTicksPerSecond : 1);
    return {channel_value(c.mScalingKeys, c.mNumScalingKeys, ticks, scale),
            channel_value(c.mRotationKeys, c.mNumRotationKeys, ticks, rotation),
            channel_value(c.mPositionKeys, c.mNumPositionKeys, ticks, place)};
  }

  AssimpFile file_;
  const aiScene* scene_ = nullptr;
  const aiNode* node_ = nullptr;
};

double seconds_at(const GltfMotion& gltf, int frame) {
  return static_cast<double>(frame - gltf.start_frame) / static_cast<double>(gltf.fps);
}

}  // namespace

Status take_camera_keys(const std::vector<int>& frames, CameraSpec& camera) {
  const GltfMotion gltf = *camera.gltf;
  BATON_ASSIGN(const AnimatedFile file, AnimatedFile::open(gltf));
  const aiCamera* const lens = file.camera();
  if (lens == nullptr) return bad_file(gltf, "node \"" + gltf.node + "\" holds no camera");

  // assimp 5.2 says the vertical angle times the aspect ratio.
  const float aspect = lens->mAspect > 0 ? lens->mAspect : 1;
  camera.vertical_fov_deg = lens->mHorizontalFOV / aspect * 180 / kPi;
  for (const int frame : frames) {
    const aiMatrix4x4 to_world = file.to_world(seconds_at(gltf, frame));
    // A camera of glTF looks along -z of its node, y up.
    const aiVector3D eye = to_world * aiVector3D();
    const aiMatrix3x3 turn(to_world);
    camera.keys.push_back({.frame = static_cast<double>(frame),
                           .position = to_vec3(eye),
                           .look_at = to_vec3(eye + turn * aiVector3D(0, 0, -1)),
                           .up = normalize(to_vec3(turn * aiVector3D(0, 1, 0)))});
  }
  camera.gltf.reset();
  return {};
}

Status take_object_keys(const std::vector<int>& frames, ObjectSpec& object) {
  const GltfMotion gltf = *object.gltf;
  BATON_ASSIGN(const AnimatedFile file, AnimatedFile::open(gltf));
  for (const int frame : frames) {
    aiVector3D scale, place;
    aiQuaternion rotation;
    file.to_world(seconds_at(gltf, frame)).Decompose(scale, rotation, place);
    object.keys.push_back({.frame = static_cast<double>(frame),
                           .translate = to_vec3(place),
                           .rotate_deg = {},
                           .quaternion = {rotation.x, rotation.y, rotation.z, rotation.w},
                           .scale = to_vec3(scale)});
  }
  object.gltf.reset();
  return {};
}

}  // namespace baton
