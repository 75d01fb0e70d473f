#pragma once

#include <embree3/rtcore.h>

#include <memory>
#include <span>
#include <string>
#include <type_traits>

#include "common/math/bounds.h"
#include "common/scene/scene.h"

/// Embree's objects, and how meshes become some.
namespace baton {

/// Owns one reference to an Embree object.
struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  void operator()(RTCGeometry geometry) const { rtcReleaseGeometry(geometry); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release>;

/// Keeps Embree's first message in the std::string behind `text`.
inline void remember_error(void* text, RTCError, const char* message) {
  auto* first = static_cast<std::string*>(text);
  if (first->empty()) *first = message != nullptr ? message : "unknown error";
}

/// Attaches the triangles of a mesh with its vertices at `positions`, moved by `to_target`, as
/// geometry `index`. holes: the scene if the mesh is cut out somewhere, else null.
void attach_instance(RTCDevice device, RTCScene target, const TriangleMesh& mesh,
                     std::span<const Vec3> positions, const Transform& to_target,
                     const Scene* holes, unsigned index);

/// Attaches a mesh that has a hierarchy of its own; geometry id = index of the instance.
void attach_placed(RTCDevice device, RTCScene target, RTCScene mesh, const Transform& to_world,
                   unsigned index);

/// The box around points after a map.
Bounds box_around(std::span<const Vec3> points, const Transform& map);
std::array<Vec3, 8> corners_of(const Bounds& box);

}  // namespace baton
