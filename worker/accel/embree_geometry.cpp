#include "worker/accel/embree_geometry.h"

#include <array>
#include <cstring>
#include <vector>

#include "common/scene/mesh/mesh_builder.h"
#include "worker/accel/cut_outs.h"

namespace baton {
namespace {

/// Fills a new buffer of the geometry; it belongs to Embree, which pads it for its wide loads.
template <class T>
void fill_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                 const std::vector<T>& elements) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), elements.size());
  if (buffer != nullptr) std::memcpy(buffer, elements.data(), elements.size() * sizeof(T));
}

/// The triangles of a mesh that deforms, which no ray meets where they have no area in this frame.
std::vector<std::array<std::uint32_t, 3>> triangles_in(const TriangleMesh& mesh,
                                                       std::span<const Vec3> positions) {
  std::vector<std::array<std::uint32_t, 3>> triangles = mesh.triangles;
  for (std::array<std::uint32_t, 3>& t : triangles) {
    if (!has_area(positions[t[0]], positions[t[1]], positions[t[2]])) t.fill(t[0]);
  }
  return triangles;
}

}  // namespace

void attach_instance(RTCDevice device, RTCScene target, const TriangleMesh& mesh,
                     std::span<const Vec3> positions, const Transform& to_target,
                     const Scene* holes, unsigned index) {
  std::vector<Vec3> placed;
  placed.reserve(positions.size());
  for (const Vec3& p : positions) placed.push_back(to_target.point(p));

  const Owned<RTCGeometry> geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  fill_buffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, placed);
  fill_buffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3,
              mesh.deformation == nullptr ? mesh.triangles : triangles_in(mesh, placed));
  if (holes != nullptr) {
    rtcSetGeometryUserData(geometry.get(), const_cast<Scene*>(holes));
    rtcSetGeometryIntersectFilterFunction(geometry.get(), pass_through_holes);
    rtcSetGeometryOccludedFilterFunction(geometry.get(), pass_through_holes);
  }
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometryByID(target, geometry.get(), index);
}

void attach_placed(RTCDevice device, RTCScene target, RTCScene mesh, const Transform& to_world,
                   unsigned index) {
  const auto& m = to_world.linear.m;
  const Vec3& o = to_world.offset;
  const std::array<float, 12> rows{m[0], m[1], m[2], o.x,  m[3], m[4],
                                   m[5], o.y,  m[6], m[7], m[8], o.z};
  const Owned<RTCGeometry> geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE));
  rtcSetGeometryInstancedScene(geometry.get(), mesh);
  rtcSetGeometryTransform(geometry.get(), 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows.data());
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometryByID(target, geometry.get(), index);
}

Bounds box_around(std::span<const Vec3> points, const Transform& map) {
  Bounds box;
  for (const Vec3& p : points) box.add(map.point(p));
  return box;
}

std::array<Vec3, 8> corners_of(const Bounds& box) {
  std::array<Vec3, 8> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = box.corner(i);
  return corners;
}

}  // namespace baton
