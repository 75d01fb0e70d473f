#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "common/base/limits.h"
#include "common/base/poison.h"
#include "common/math/bounds.h"
#include "common/scene/camera.h"
#include "common/scene/scene.h"
#include "worker/surface/seen_surface.h"

namespace baton {

/// What a primary ray saw.
struct SurfaceHit {
  ShadingPoint point;  ///< position, normals to the viewer, wo
  /// Where shadow rays start: the position, lifted off (lift_off).
  Vec3 ray_origin{};
  float depth = 0;  ///< distance along the ray; 0 without a hit
  std::uint32_t instance = 0;
  std::uint32_t material = 0;
  bool hit = false;
  /// The surface catches shadows (worker/pass/catcher.h). `hit` is false where the pixel sees an
  /// object, too.
  bool is_catcher = false;
  /// Where the material has detail or the mesh deforms, else all 0.
  SurfacePlace place{};

  bool operator==(const SurfaceHit&) const = default;
};

/// Rays that only ask "is the way to infinity free?", as structure of arrays; the layout of
/// Embree's streams. Origins are already lifted off their surface (lift_off).
struct ShadowRays {
  /// (capacity) of which the first size() are rays.
  std::vector<float> origin_x, origin_y, origin_z, direction_x, direction_y, direction_z;
  std::vector<float> t_near, t_far;  ///< t_far < 0 after tracing: occluded

  std::size_t size() const { return count_; }
  Vec3 origin(std::size_t i) const { return {origin_x[i], origin_y[i], origin_z[i]}; }
  Vec3 direction(std::size_t i) const { return {direction_x[i], direction_y[i], direction_z[i]}; }
  void clear() {
    count_ = 0;
    for (auto* column : {&origin_x, &origin_y, &origin_z, &direction_x, &direction_y, &direction_z})
      poison(*column);
    poison(t_far);
  }
  /// Makes room for `capacity` rays in all.
  void reserve(std::size_t capacity);
  /// Counts rays [size(), count) whose origins and directions the caller has written; within the
  /// reserved capacity.
  void extend(std::size_t count) {
    std::fill(t_far.begin() + static_cast<std::ptrdiff_t>(count_),
              t_far.begin() + static_cast<std::ptrdiff_t>(count),
              std::numeric_limits<float>::infinity());
    count_ = count;
  }
  void push(const Vec3& origin, const Vec3& direction) {
    if (count_ == t_far.size()) reserve(std::max<std::size_t>(1024, 2 * count_));
    push_if(true, origin, direction);
  }
  /// Adds a ray that may not be wanted, without a branch; there must be room (reserve).
  void push_if(bool wanted, const Vec3& origin, const Vec3& direction) {
    const std::size_t i = count_;
    count_ += wanted ? 1 : 0;
    origin_x[i] = origin.x;
    origin_y[i] = origin.y;
    origin_z[i] = origin.z;
    direction_x[i] = direction.x;
    direction_y[i] = direction.y;
    direction_z[i] = direction.z;
    t_far[i] = std::numeric_limits<float>::infinity();
  }

 private:
  std::size_t count_ = 0;
};

/// How far origins of shadow rays are lifted off a surface: coordinates below kLiftOrigin by a
/// distance, others by a number of float steps, but at least by what is rounded along the normal.
struct Lift {
  float near = 1.0f / 65536;
  float steps = 256;
  /// Rounding of rays that the ray tracer takes to the space of the mesh, along each axis of the
  /// world; 0 where the mesh lies in the world.
  Vec3 of_rays{};

  bool operator==(const Lift&) const = default;
};
inline constexpr float kLiftOrigin = 1.0f / 32;
/// The lift of a surface in these bounds, in the world. Most have the default; those that are small
/// beside it, or beside the float spacing where they are, a smaller one: the distance is at most
/// 2^-14 of the largest coordinate, the steps at most 2^-10 of the size, and 16 or more.
Lift lift_of(const Bounds& bounds);
/// Lift::of_rays of a mesh that lies in a space of its own, with `bounds` in the world.
Vec3 rounding_of_rays(const Instance& instance, const Bounds& bounds);
/// Rounding of a position between the corners of a triangle, as a share of the mean of their
/// coordinates without signs [Pharr, Jakob & Humphreys 2023, section 6.8].
inline constexpr float kPositionError = 0x1p-21f;
/// The origin of a shadow ray: `position` lifted along the geometric normal just so far that float
/// error cannot make the surface shadow itself: coordinate by coordinate [Waechter & Binder 2019],
/// and where that is less, as off planes along an axis whose coordinate is large, by the error of
/// all coordinates along the normal. extent: the mean of the triangle's corners there, without
/// signs.
Vec3 lift_off(const Vec3& position, const Vec3& extent, const Vec3& ng, const Lift& lift);
/// The same on a small triangle.
Vec3 lift_off(const Vec3& position, const Vec3& ng, const Lift& lift = {});

/// How a ray tracer is built.
struct AccelLimits {
  /// Triangles of meshes that stand still in several places, in one flat hierarchy; where their
  /// copies would have more, they have hierarchies of their own.
  std::uint64_t max_copied_triangles = limits::kMaxCopiedTriangles;
  std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max();
};

/// Most rays that are traced as one packet.
inline constexpr std::size_t kMaxRayGroup = 16;

/// The ray tracer: the only user of Embree. Immutable after construction; any number of
/// threads may trace. Shadow catchers (Instance::is_catcher) are apart from all else.
class Accel {
 public:
  /// Keeps a reference to `scene`, which must outlive it. What stands still is one flat hierarchy;
  /// each mesh that moves has its own, placed where the scene says, unless it deforms: then it has
  /// one in each frame. Errors: bad_input where it would take more than limits.max_bytes; Embree's
  /// own message.
  static Result<std::unique_ptr<Accel>> build(const Scene& scene, const AccelLimits& limits = {});
  virtual ~Accel() = default;

  /// The same geometry with its moving instances elsewhere and its deforming meshes in another
  /// shape; shares all that does not deform. instances: those of the scene in its order, moved.
  /// Both must outlive the result. Error: Embree's own message.
  virtual Result<std::unique_ptr<const Accel>> place(std::span<const Instance> instances,
                                                     const MeshShapes& shapes) const = 0;

  /// Closest hit of each ray; hits.size() == rays.size(). The rays come in groups of `group` (1 to
  /// kMaxRayGroup; the last one may be smaller) that start nearby and point alike, such as the
  /// sites of a pixel; a hit depends on no ray of another group.
  virtual void intersect(std::span<const Ray> rays, std::span<SurfaceHit> hits,
                         std::size_t group = 1) const = 0;
  /// Closest hits of shadow catchers alone, which intersect() and occluded() pass, ray by ray.
  virtual void intersect_catchers(std::span<const Ray> rays, std::span<SurfaceHit> hits) const = 0;
  /// Traces all rays; t_far of the occluded ones becomes -inf.
  virtual void occluded(ShadowRays& rays) const = 0;
  /// What Embree has allocated for this geometry in all its placements.
  virtual std::uint64_t size_bytes() const = 0;
  /// About what one placement takes of that for itself.
  virtual std::uint64_t placement_bytes() const = 0;
  /// "Embree 3.13.5, AVX2" for the benchmark and --version.
  virtual std::string description() const = 0;
};

}  // namespace baton
