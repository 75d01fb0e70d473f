#pragma once

#include <cstdint>
#include <memory>
#include <mutex>

#include "common/base/limits.h"
#include "common/base/lru_cache.h"
#include "common/job/plan/timeline.h"
#include "common/scene/pose.h"
#include "worker/accel/accel.h"
#include "worker/surface/site_block.h"

namespace baton {

/// What rays hit in one frame, and where they start.
struct FrameGeometry {
  Pose pose;
  std::shared_ptr<const Accel> accel;
  const Scene* scene = nullptr;

  const Material& material_of(const SurfaceHit& hit) const {
    return scene->materials[hit.material];
  }
  /// Sets a site to what it hit. look: of the hit, where it is kept, else null. Returns the
  /// radiance that the surface emits.
  Rgb add_to(SiteBlock& sites, int site, const SurfaceHit& hit,
             const SurfaceShading* shading = nullptr) const {
    const Material& material = material_of(hit);
    if (material.detail == nullptr) {
      sites.add(site, hit.point, material);
      return {};
    }
    const SeenSurface seen = see(hit, shading);
    sites.add(site, seen.point, seen.material);
    return seen.emission;
  }
  /// A hit, with what textures say of it. Normals of hits are those of the mesh: history compares
  /// them.
  SeenSurface see(const SurfaceHit& hit, const SurfaceShading* shading = nullptr) const {
    const Material& material = material_of(hit);
    if (material.detail == nullptr) return {hit.point, material, {}};
    if (shading != nullptr) return shading->at(hit.point, material);
    return see_detail(*scene, pose.instances[hit.instance], hit.place, hit.point, pose.shapes);
  }
  /// Where the point of a hit of this frame is in another pose, and its shading normal.
  Vec3 point_in(const Pose& other, const SurfaceHit& hit) const {
    if (!pose.instances[hit.instance].moves()) return hit.point.position;
    return carry_point(*scene, pose, other, {hit.instance, hit.place, hit.point.position});
  }
  Vec3 normal_in(const Pose& other, const SurfaceHit& hit) const {
    if (!pose.instances[hit.instance].moves()) return hit.point.ns;
    return carry_normal(*scene, pose, other, {hit.instance, hit.place, hit.point.ns});
  }
  /// Memory of what deforms.
  std::size_t size_bytes() const;
};

/// The geometry of a job's frames, placed on demand and kept for the frames used last. What stands
/// still is built once, moving objects once each; a frame only places them, and builds what
/// deforms. Any number of threads may ask. A frame's geometry is a pure function of (job, frame).
class GeometrySequence {
 public:
  /// job and scene must outlive the object. rest: the scene's ray tracer, may be shared with other
  /// jobs. share: of memory, for what deforms; the two frames used last stay in any case.
  GeometrySequence(const JobSpec& job, const Scene& scene, std::shared_ptr<const Accel> rest,
                   MemorySharePtr share)
      : job_(job),
        timeline_(job),
        scene_(scene),
        rest_(std::move(rest)),
        frames_(
            std::move(share), [](const FrameGeometry& frame) { return frame.size_bytes(); },
            limits::kMaxCachedPoses, 2) {}

  /// The geometry of a step. Error: Embree's own message.
  Result<std::shared_ptr<const FrameGeometry>> at(Step step);

 private:
  const JobSpec& job_;
  const Timeline timeline_;
  const Scene& scene_;
  const std::shared_ptr<const Accel> rest_;  ///< every frame's, when no object moves
  std::mutex placing_;
  LruCache<FrameIndex, FrameGeometry> frames_;
};

}  // namespace baton
