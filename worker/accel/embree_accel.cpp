#include <embree3/rtcore.h>

#include <array>
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

/// Keeps Embree's first message in the std::string behind `text`.
void remember_error(void* text, RTCError, const char* message) {
  auto* first = static_cast<std::string*>(text);
  if (first->empty()) *first = message != nullptr ? message : "unknown error";
}

/// Fills a new buffer of the geometry; it belongs to Embree, which pads it for its wide loads.
template <class T>
void fill_buffer(RTCGeometry geometry, RTCBufferType type, RTCFormat format,
                 const std::vector<T>& elements) {
  void* buffer = rtcSetNewGeometryBuffer(geometry, type, 0, format, sizeof(T), elements.size());
  if (buffer != nullptr) std::memcpy(buffer, elements.data(), elements.size() * sizeof(T));
}

/// Attaches the triangles of an instance in world space; geometry id = index of the instance.
void attach_instance(RTCDevice device, RTCScene target, const Scene& scene, unsigned index) {
  const Instance& instance = scene.instances[index];
  const TriangleMesh& mesh = scene.meshes[instance.mesh];
  std::vector<Vec3> positions;
  positions.reserve(mesh.positions.size());
  for (const Vec3& p : mesh.positions) positions.push_back(instance.to_world.point(p));

  const Owned<RTCGeometry> geometry(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE));
  fill_buffer(geometry.get(), RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, positions);
  fill_buffer(geometry.get(), RTC_BUFFER_TYPE_INDEX, RTC_FORMAT_UINT3, mesh.triangles);
  rtcCommitGeometry(geometry.get());
  rtcAttachGeometryByID(target, geometry.get(), index);
}

/// Instances are placed in one flat hierarchy: a second level costs a third of the shadow rays'
/// speed. The floating-point environment stays as it is (Embree suggests flush-to-zero): results
/// must not depend on the thread that traces.
class EmbreeAccel final : public Accel {
 public:
  EmbreeAccel(const Scene& scene, Owned<RTCDevice> device, Owned<RTCScene> traced)
      : scene_(scene), device_(std::move(device)), traced_(std::move(traced)) {}

  void intersect(std::span<const Ray> rays, std::span<SurfaceHit> hits) const override {
    BATON_CHECK(rays.size() == hits.size());
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (std::size_t i = 0; i < rays.size(); ++i) hits[i] = intersect_one(rays[i], context);
  }

  /// One stream of all rays, without the `coherent` flag, which makes scattered rays three times
  /// slower. A ray's answer does not depend on the rays beside it (tests/unit/accel).
  void occluded(ShadowRays& rays) const override {
    BATON_CHECK(rays.size() <= std::numeric_limits<unsigned>::max());
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    const RTCRayNp stream{.org_x = rays.origin_x.data(),
                          .org_y = rays.origin_y.data(),
                          .org_z = rays.origin_z.data(),
                          .tnear = rays.t_near.data(),
                          .dir_x = rays.direction_x.data(),
                          .dir_y = rays.direction_y.data(),
                          .dir_z = rays.direction_z.data(),
                          .time = nullptr,
                          .tfar = rays.t_far.data(),
                          .mask = nullptr,
                          .id = nullptr,
                          .flags = nullptr};
    rtcOccludedNp(traced_.get(), &context, &stream, static_cast<unsigned>(rays.size()));
  }

  std::string description() const override {
    const auto native = [this](RTCDeviceProperty p) {
      return rtcGetDeviceProperty(device_.get(), p) != 0;
    };
    const char* isa = native(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)   ? "AVX-512"
                      : !native(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? "SSE"
                      : __builtin_cpu_supports("avx2")                     ? "AVX2"
                                                                           : "AVX";
    return std::string("Embree ") + RTC_VERSION_STRING + ", " + isa;
  }

 private:
  /// Single rays, by construction independent of their neighbours.
  SurfaceHit intersect_one(const Ray& ray, RTCIntersectContext& context) const {
    RTCRayHit query{};
    query.ray = {.org_x = ray.origin.x,
                 .org_y = ray.origin.y,
                 .org_z = ray.origin.z,
                 .tnear = 0,
                 .dir_x = ray.direction.x,
                 .dir_y = ray.direction.y,
                 .dir_z = ray.direction.z,
                 .time = 0,
                 .tfar = std::numeric_limits<float>::infinity(),
                 .mask = ~0u,
                 .id = 0,
                 .flags = 0};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(traced_.get(), &context, &query);
    return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? SurfaceHit{} : surface_at(ray, query);
  }

  /// The surface at a hit. The position comes from the barycentric coordinates: it lies on the
  /// triangle to a few float steps, however far the ray has come.
  SurfaceHit surface_at(const Ray& ray, const RTCRayHit& query) const {
    const Instance& instance = scene_.instances[query.hit.geomID];
    const TriangleMesh& mesh = scene_.meshes[instance.mesh];
    const auto& corner = mesh.triangles[query.hit.primID];
    const float u = query.hit.u;
    const float v = query.hit.v;
    const auto interpolate = [u, v](const Vec3& a, const Vec3& b, const Vec3& c) {
      return a * (1 - u - v) + b * u + c * v;
    };
    const Vec3 a = instance.to_world.point(mesh.positions[corner[0]]);
    const Vec3 b = instance.to_world.point(mesh.positions[corner[1]]);
    const Vec3 c = instance.to_world.point(mesh.positions[corner[2]]);

    // Turn the geometric normal to the viewer, the shading normal to the geometric one.
    const Vec3 wo = -ray.direction;
    Vec3 ng = normalize(cross(b - a, c - a));
    if (dot(ng, wo) < 0) ng = -ng;
    Vec3 ns = ng;
    if (!mesh.normals.empty()) {
      ns = normalize(instance.normal_to_world * interpolate(mesh.normals[corner[0]],
                                                            mesh.normals[corner[1]],
                                                            mesh.normals[corner[2]]));
      if (dot(ns, ng) < 0) ns = -ns;
      if (!(dot(ns, ng) > 0)) ns = ng;
    }
    return {.point = {.position = interpolate(a, b, c), .ng = ng, .ns = ns, .wo = wo},
            .depth = query.ray.tfar,
            .instance = query.hit.geomID,
            .material = instance.material,
            .hit = true};
  }

  const Scene& scene_;
  Owned<RTCDevice> device_;
  Owned<RTCScene> traced_;
};

}  // namespace

Result<std::unique_ptr<Accel>> Accel::build(const Scene& scene) {
  // One build thread: answers at edges depend on the shape of the tree, which must not depend on
  // the host.
  Owned<RTCDevice> device(rtcNewDevice("threads=1"));
  if (device == nullptr) {
    return Error{ErrorKind::internal, "Embree: cannot make a device, error " +
                                          std::to_string(rtcGetDeviceError(nullptr))};
  }
  std::string message;
  rtcSetDeviceErrorFunction(device.get(), remember_error, &message);

  Owned<RTCScene> traced(rtcNewScene(device.get()));
  rtcSetSceneBuildQuality(traced.get(), RTC_BUILD_QUALITY_HIGH);
  for (unsigned i = 0; i < scene.instances.size(); ++i) {
    attach_instance(device.get(), traced.get(), scene, i);
  }
  rtcCommitScene(traced.get());
  rtcSetDeviceErrorFunction(device.get(), nullptr, nullptr);
  if (!message.empty()) return Error{ErrorKind::internal, "Embree: " + message};
  return std::unique_ptr<Accel>(
      std::make_unique<EmbreeAccel>(scene, std::move(device), std::move(traced)));
}

}  // namespace baton
