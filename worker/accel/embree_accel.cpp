#include <embree3/rtcore.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "common/base/check.h"
#include "worker/accel/accel.h"

namespace baton {
namespace {

/// Owns one reference to an Embree object.
struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

void remember_error(void* text, RTCError, const char* message) {
  auto* first = static_cast<std::string*>(text);
  if (first->empty()) *first = message != nullptr ? message : "unknown error";
}

/// Copies `elements` into a new buffer of the geometry; Embree pads it for its wide loads.
template <class T>
void fill_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format, const std::vector<T>& elements) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), elements.size());
  if (buffer != nullptr) std::memcpy(buffer, elements.data(), elements.size() * sizeof(T));
}

Owned<RTCScene> new_scene(RTCDevice device) {
  Owned<RTCScene> scene(rtcNewScene(device));
  rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_NONE);
  rtcSetSceneBuildQuality(scene.get(), RTC_BUILD_QUALITY_HIGH);
  return scene;
}

Owned<RTCScene> build_mesh(RTCDevice device, const TriangleMesh& mesh) {
  const Owned<RTCGeometry> geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  fill_buffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, mesh.positions);
  fill_buffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles);
  rtcCommitGeometry(geometry.get());
  Owned<RTCScene> scene = new_scene(device);
  rtcAttachGeometryByID(scene.get(), geometry.get(), 0);
  rtcCommitScene(scene.get());
  return scene;
}

void attach_instance(RTCDevice device, RTCScene top, RTCScene mesh, const Transform& to_world, unsigned id) {
  const Owned<RTCGeometry> geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
  const auto& m = to_world.linear.m;
  const Vec3& t = to_world.offset;
  const std::array<float, 12> rows{m[0], m[1], m[2], t.x, m[3], m[4], m[5], t.y, m[6], m[7], m[8], t.z};
  rtcSetGeometryInstancedScene(geometry.get(), mesh);
  rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows.data());
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometryByID(top, geometry.get(), id);
}

}  // namespace

}  // namespace baton
