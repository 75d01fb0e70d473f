#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <vector>

#include "common/base/check.h"
#include "common/math/instruction_set.h"
#include "worker/accel/accel.h"
#include "worker/accel/allocation_count.h"
#include "worker/accel/cut_outs.h"
#include "worker/accel/embree_geometry.h"
#include "worker/accel/surface_kernels.h"

namespace baton {
namespace {

/// Instances that rays meet together: the objects, or the shadow catchers.
struct Layer {
  bool catchers = false;
  /// All that does not move, in world space; null without instances.
  Owned<RTCScene> still;
  bool any_moves = false;

  bool has(const Instance& instance) const { return instance.is_catcher == catchers; }
};

/// What a ray asks: what stands still, then what moves; null where there is nothing.
struct PlacedLayer {
  RTCScene still = nullptr, moving = nullptr;
};

/// What all poses of a scene share.
struct SharedGeometry {
  AllocationCount allocated;  ///< outlives what it counts
  /// Placements of several jobs tell their errors one by one.
  mutable std::mutex placing{};
  Owned<RTCDevice> device;
  Layer objects, catchers{.catchers = true, .still = {}};
  /// By index of the mesh, in its own space: those that move, or that are in too many places.
  std::map<std::uint32_t, Owned<RTCScene>> own_meshes;
  std::set<std::uint32_t> with_holes;  ///< meshes that are cut out somewhere
  bool any_blends = false;             ///< rays need their bits
  std::uint64_t placement_bytes = 0;   ///< what is built for each placement
  /// Corners of each mesh's box, in its own space.
  std::vector<std::array<Vec3, 8>> boxes;

  const Scene* holes_of(const Scene& scene, std::uint32_t mesh) const {
    return with_holes.contains(mesh) ? &scene : nullptr;
  }
  std::uint64_t size_bytes() const {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, allocated.bytes));
  }
  /// Robust, so that rays do not slip through the edges of closed meshes. lasts: for the whole job.
  /// The best hierarchy of one frame's triangles takes five times as long to build as a good one,
  /// and gains at most a tenth of the rays' time.
  Owned<RTCScene> new_scene(bool lasts = true) const {
    Owned<RTCScene> scene(rtcNewScene(device.get()));
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene.get(), lasts ? RTC_BUILD_QUALITY_HIGH : RTC_BUILD_QUALITY_MEDIUM);
    return scene;
  }
};

/// Still instances are placed in one flat hierarchy: a second level costs a third of the shadow
/// rays' speed. A ray asks it first, then the moving instances, which have a small hierarchy of
/// their own: for each frame one, in which meshes that deform lie flat. The floating-point
/// environment stays as it is (Embree suggests flush-to-zero): results must not depend on the
/// thread that traces.
class EmbreeAccel final : public Accel {
 public:
  /// moving, moving_catchers: null when nothing moves.
  EmbreeAccel(const Scene& scene, std::shared_ptr<const SharedGeometry> geometry,
              std::span<const Instance> instances, const MeshShapes& shapes, Owned<RTCScene> moving,
              Owned<RTCScene> moving_catchers)
      : scene_(scene),
        geometry_(std::move(geometry)),
        instances_(instances),
        moving_(std::move(moving)),
        moving_catchers_(std::move(moving_catchers)),
        objects_{geometry_->objects.still.get(), moving_.get()},
        catchers_{geometry_->catchers.still.get(), moving_catchers_.get()} {
    for (std::uint32_t i = 0; i < scene.meshes.size(); ++i)
      vertices_.push_back(vertices_of(scene, shapes, i));
    for (const Instance& instance : instances) {
      const std::span<const Vec3> points =
          instance.deforms ? vertices_[instance.mesh].positions : geometry_->boxes[instance.mesh];
      const Bounds bounds = box_around(points, instance.to_world);
      lifts_.push_back(lift_of(bounds));
      const bool lies_apart = !instance.deforms && geometry_->own_meshes.contains(instance.mesh);
      if (lies_apart) lifts_.back().of_rays = rounding_of_rays(instance, bounds);
    }
  }

  static Result<std::unique_ptr<EmbreeAccel>> make(const Scene& scene,
                                                   std::shared_ptr<const SharedGeometry> geometry,
                                                   std::span<const Instance> instances,
                                                   const MeshShapes& shapes) {
    Owned<RTCScene> moving, moving_catchers;
    std::string message;
    if (geometry->objects.any_moves || geometry->catchers.any_moves) {
      const std::lock_guard lock(geometry->placing);
      RTCDevice device = geometry->device.get();
      rtcSetDeviceErrorFunction(device, remember_error, &message);
      moving = move(scene, *geometry, geometry->objects, instances, shapes);
      moving_catchers = move(scene, *geometry, geometry->catchers, instances, shapes);
      rtcSetDeviceErrorFunction(device, nullptr, nullptr);
    }
    if (!message.empty()) return Error{ErrorKind::internal, "Embree: " + message};
    return std::make_unique<EmbreeAccel>(scene, std::move(geometry), instances, shapes,
                                         std::move(moving), std::move(moving_catchers));
  }

  Result<std::unique_ptr<const Accel>> place(std::span<const Instance> instances,
                                             const MeshShapes& shapes) const override {
    BATON_CHECK(instances.size() == instances_.size());
    BATON_ASSIGN(std::unique_ptr<const Accel> placed, make(scene_, geometry_, instances, shapes));
    return Result<std::unique_ptr<const Accel>>(std::move(placed));
  }

  /// A group is one packet: the same rays give the same hits, whatever else is traced with them.
  void intersect(std::span<const Ray> rays, std::span<SurfaceHit> hits,
                 std::size_t group) const override {
    BATON_CHECK(rays.size() == hits.size() && group >= 1 && group <= kMaxRayGroup);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    see(objects_, rays, hits, group, context);
  }

  void intersect_catchers(std::span<const Ray> rays, std::span<SurfaceHit> hits) const override {
    BATON_CHECK(rays.size() == hits.size());
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    see(catchers_, rays, hits, 1, context);
  }

  /// One stream of all rays, without the `coherent` flag, which makes scattered rays three times
  /// slower. A ray's answer does not depend on the rays beside it (tests/unit/accel).
  void occluded(ShadowRays& rays) const override {
    BATON_CHECK(rays.size() <= std::numeric_limits<unsigned>::max());
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    std::vector<unsigned> bits(geometry_->any_blends ? rays.size() : 0);
    for (std::size_t i = 0; i < bits.size(); ++i)
      bits[i] = ray_bits(rays.origin(i), rays.direction(i));
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
                          .id = bits.empty() ? nullptr : bits.data(),
                          .flags = nullptr};
    const auto count = static_cast<unsigned>(rays.size());
    rtcOccludedNp(objects_.still, &context, &stream, count);
    // Rays that are blocked already have t_far = -inf, which Embree leaves alone.
    if (objects_.moving != nullptr) rtcOccludedNp(objects_.moving, &context, &stream, count);
  }

  std::uint64_t size_bytes() const override { return geometry_->size_bytes(); }

  std::uint64_t placement_bytes() const override { return geometry_->placement_bytes; }

  std::string description() const override {
    const auto native = [this](RTCDeviceProperty p) {
      return rtcGetDeviceProperty(geometry_->device.get(), p) != 0;
    };
    const char* isa = native(RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED)   ? "AVX-512"
                      : !native(RTC_DEVICE_PROPERTY_NATIVE_RAY8_SUPPORTED) ? "SSE"
                      : __builtin_cpu_supports("avx2")                     ? "AVX2"
                                                                           : "AVX";
    return std::string("Embree ") + RTC_VERSION_STRING + ", " + isa;
  }

 private:
  /// The instances of a layer that move, in a pose; null: there are none.
  static Owned<RTCScene> move(const Scene& scene, const SharedGeometry& geometry,
                              const Layer& layer, std::span<const Instance> instances,
                              const MeshShapes& shapes) {
    if (!layer.any_moves) return nullptr;
    RTCDevice device = geometry.device.get();
    Owned<RTCScene> moving =
        geometry.new_scene(std::ranges::none_of(instances, [&](const Instance& instance) {
          return instance.deforms && layer.has(instance);
        }));
    for (unsigned i = 0; i < instances.size(); ++i) {
      const Instance& instance = instances[i];
      if (!layer.has(instance) || instance.is_absent) continue;
      if (instance.deforms) {
        attach_instance(device, moving.get(), scene.meshes[instance.mesh],
                        vertices_of(scene, shapes, instance.mesh).positions, instance.to_world,
                        geometry.holes_of(scene, instance.mesh), i);
      } else if (instance.moves()) {
        attach_placed(device, moving.get(), geometry.own_meshes.at(instance.mesh).get(),
                      instance.to_world, i);
      }
    }
    rtcCommitScene(moving.get());
    return moving;
  }

  std::uint32_t bits_of(const Ray& ray) const {
    return geometry_->any_blends ? ray_bits(ray.origin, ray.direction) : 0;
  }

  /// As many groups at a time as there are lanes for the surfaces that they see.
  void see(const PlacedLayer& layer, std::span<const Ray> rays, std::span<SurfaceHit> hits,
           std::size_t group, RTCIntersectContext& context) const {
    const std::size_t width = group == 1 ? 1 : group <= 4 ? 4 : 16;
    const std::size_t at_once = kMaxRayGroup / width * group;
    for (std::size_t first = 0; first < rays.size(); first += at_once) {
      const std::size_t end = std::min(first + at_once, rays.size());
      kernels::MetTriangles met;
      for (std::size_t i = first; i < end; i += group) {
        const std::span<const Ray> some = rays.subspan(i, std::min(group, end - i));
        if (width == 1) {
          trace<RTCRayHit, 1>(layer, some, met, [&](const int*, RTCScene scene, RTCRayHit* query) {
            rtcIntersect1(scene, &context, query);
          });
        } else if (width == 4) {
          trace<RTCRayHit4, 4>(layer, some, met, [&](const int* on, RTCScene scene, auto* query) {
            rtcIntersect4(on, scene, &context, query);
          });
        } else {
          trace<RTCRayHit16, 16>(layer, some, met, [&](const int* on, RTCScene scene, auto* query) {
            rtcIntersect16(on, scene, &context, query);
          });
        }
      }
      see(met, hits.subspan(first, end - first));
    }
  }

  /// Adds what a packet of rays meets; the lanes that are left over are off.
  template <class Packet, std::size_t kWidth, class Intersect>
  void trace(const PlacedLayer& layer, std::span<const Ray> rays, kernels::MetTriangles& met,
             const Intersect& intersect) const {
    alignas(64) RTCRayHitNt<kWidth> query{};
    static_assert(sizeof(query.ray) == sizeof(Packet::ray) &&
                  sizeof(query.hit) == sizeof(Packet::hit));
    alignas(64) std::array<int, kWidth> valid{};
    for (std::size_t k = 0; k < rays.size(); ++k) {
      valid[k] = -1;
      query.ray.org_x[k] = rays[k].origin.x;
      query.ray.org_y[k] = rays[k].origin.y;
      query.ray.org_z[k] = rays[k].origin.z;
      query.ray.dir_x[k] = rays[k].direction.x;
      query.ray.dir_y[k] = rays[k].direction.y;
      query.ray.dir_z[k] = rays[k].direction.z;
      query.ray.tfar[k] = std::numeric_limits<float>::infinity();
      query.ray.mask[k] = ~0u;
      query.ray.id[k] = bits_of(rays[k]);
      query.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
      query.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    auto* const packet = reinterpret_cast<Packet*>(&query);
    if (layer.still != nullptr) intersect(valid.data(), layer.still, packet);
    if (layer.moving != nullptr) intersect(valid.data(), layer.moving, packet);

    BATON_DCHECK(met.count + kWidth <= kMaxRayGroup);
    const auto note = [at = met.count](const auto& from, auto& lanes) {
      std::copy_n(from, kWidth, lanes.begin() + at);
    };
    note(query.ray.dir_x, met.direction_x);
    note(query.ray.dir_y, met.direction_y);
    note(query.ray.dir_z, met.direction_z);
    note(query.ray.tfar, met.depth);
    note(query.hit.u, met.u);
    note(query.hit.v, met.v);
    note(query.hit.primID, met.triangle);
    for (std::size_t k = 0; k < kWidth; ++k) {
      const unsigned instance = query.hit.instID[0][k];
      met.instance[met.count + k] =
          instance != RTC_INVALID_GEOMETRY_ID ? instance : query.hit.geomID[k];
    }
    met.count += rays.size();
  }

  /// The surfaces of all lanes, instance by instance.
  void see(const kernels::MetTriangles& met, std::span<SurfaceHit> hits) const {
    for (std::size_t lane = 0; lane < met.count; ++lane) {
      const std::uint32_t index = met.instance[lane];
      if (index == kernels::MetTriangles::kNothing) {
        hits[lane] = {};
        continue;
      }
      const auto before = std::span(met.instance).first(lane);
      if (std::find(before.begin(), before.end(), index) != before.end()) continue;
      const Instance& instance = instances_[index];
      kernels::see_surfaces(
          met, lane, instance, scene_.meshes[instance.mesh].triangles, vertices_[instance.mesh],
          lifts_[index], scene_.material_of(instance).detail != nullptr || instance.deforms, hits);
    }
  }

  const Scene& scene_;
  const std::shared_ptr<const SharedGeometry> geometry_;
  const std::span<const Instance> instances_;
  std::vector<MeshVertices> vertices_;  ///< by mesh
  std::vector<Lift> lifts_;             ///< by instance
  const Owned<RTCScene> moving_, moving_catchers_;
  const PlacedLayer objects_, catchers_;
};

/// Meshes of a layer that stand still in several places, where their copies would be too many.
std::set<std::uint32_t> shared_meshes(const Scene& scene, const Layer& layer,
                                      std::uint64_t max_copied_triangles) {
  std::set<std::uint32_t> seen, repeated;
  std::uint64_t copied = 0;
  for (const Instance& instance : scene.instances) {
    if (!layer.has(instance) || instance.moves() || seen.insert(instance.mesh).second) continue;
    repeated.insert(instance.mesh);
    copied += scene.meshes[instance.mesh].triangles.size();
  }
  return copied > max_copied_triangles ? repeated : std::set<std::uint32_t>{};
}

/// Builds what stands still of a layer, and the meshes that do not lie flat.
void build_layer(const Scene& scene, std::uint64_t max_copied_triangles, SharedGeometry& geometry,
                 Layer& layer) {
  RTCDevice device = geometry.device.get();
  const std::set<std::uint32_t> shared = shared_meshes(scene, layer, max_copied_triangles);
  layer.still = geometry.new_scene();
  for (unsigned i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (!layer.has(instance)) continue;
    layer.any_moves = layer.any_moves || instance.moves();
    if (instance.deforms) continue;
    const std::vector<Vec3>& positions = scene.meshes[instance.mesh].positions;
    const Scene* const holes = geometry.holes_of(scene, instance.mesh);
    if (!instance.moves() && !shared.contains(instance.mesh)) {
      attach_instance(device, layer.still.get(), scene.meshes[instance.mesh], positions,
                      instance.to_world, holes, i);
      continue;
    }
    Owned<RTCScene>& own = geometry.own_meshes[instance.mesh];
    if (own == nullptr) {
      own = geometry.new_scene();
      attach_instance(device, own.get(), scene.meshes[instance.mesh], positions, {}, holes, 0);
      rtcCommitScene(own.get());
    }
    if (!instance.moves())
      attach_placed(device, layer.still.get(), own.get(), instance.to_world, i);
  }
  rtcCommitScene(layer.still.get());
}

}  // namespace

Result<std::unique_ptr<Accel>> Accel::build(const Scene& scene, const AccelLimits& limits) {
  // One build thread: answers at edges depend on the shape of the tree, which must not depend on
  // the host.
  auto geometry = std::make_shared<SharedGeometry>();
  geometry->device.reset(rtcNewDevice(("threads=1" + embree_isa()).c_str()));
  RTCDevice device = geometry->device.get();
  if (device == nullptr) {
    return Error{ErrorKind::internal, "Embree: cannot make a device, error " +
                                          std::to_string(rtcGetDeviceError(nullptr))};
  }
  std::string message;
  rtcSetDeviceErrorFunction(device, remember_error, &message);
  AllocationCount& allocated = geometry->allocated;
  allocated.allowed = static_cast<std::int64_t>(
      std::min<std::uint64_t>(limits.max_bytes, std::numeric_limits<std::int64_t>::max()));
  rtcSetDeviceMemoryMonitorFunction(device, AllocationCount::note, &allocated);

  // What stands still, in world space; each mesh that moves, in its own.
  for (const TriangleMesh& mesh : scene.meshes)
    geometry->boxes.push_back(corners_of(box_around(mesh.positions, {})));
  geometry->any_blends = any_blends(scene);
  geometry->with_holes = meshes_with_holes(scene);
  build_layer(scene, limits.max_copied_triangles, *geometry, geometry->objects);
  if (std::ranges::any_of(scene.instances, &Instance::is_catcher))
    build_layer(scene, limits.max_copied_triangles, *geometry, geometry->catchers);
  rtcSetDeviceErrorFunction(device, nullptr, nullptr);
  const std::uint64_t shared_bytes = geometry->size_bytes();
  Result<std::unique_ptr<EmbreeAccel>> accel =
      EmbreeAccel::make(scene, geometry, scene.instances, {});
  geometry->placement_bytes =
      geometry->size_bytes() - std::min(geometry->size_bytes(), shared_bytes);
  if (allocated.was_exceeded) {
    return Error{ErrorKind::bad_input, "the ray tracer would take more than " +
                                           std::to_string(limits.max_bytes) + " bytes"};
  }
  if (!message.empty()) return Error{ErrorKind::internal, "Embree: " + message};
  if (!accel) return accel.error();
  allocated.allowed = std::numeric_limits<std::int64_t>::max();  // caches count what frames take
  return Result<std::unique_ptr<Accel>>(std::move(*accel));
}

}  // namespace baton
