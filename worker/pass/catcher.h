#pragma once

#include <span>
#include <vector>

#include "worker/bounce/bounce_walk.h"
#include "worker/light/frame_light.h"
#include "worker/pass/aside.h"
#include "worker/pass/render_context.h"

namespace baton {

/// What catches shadows (ObjectSpec::catcher, GroundSpec::catcher) is in no image. Where a ray
/// meets no object it sees the nearest catcher, which reflects with the albedo pi / E per channel
/// (CatcherAlbedo): what methods estimate of it is the share of the light that arrives, S / U, with
/// all their machinery and without bias; what objects throw onto it is part of S. A pixel that sees
/// an object, too, or has seen one in an earlier round, belongs to that: its sites on catchers are
/// sampled beside it, afresh in each round, so that objects have the same bytes with and without
/// catchers.

/// Lets rays that meet no object see catchers. num_sites: of each pixel; those of a pixel follow
/// each other. In pixels that see an object `hit` stays false.
void see_catchers(const FrameGeometry& geometry, std::span<const std::uint16_t> num_sites,
                  std::span<const Ray> rays, std::span<SurfaceHit> hits);

/// Share of the sites that see a catcher.
float catcher_share(std::span<const SurfaceHit> hits);
/// Share of the sites that see a catcher where no light of a colour arrives without shadows, so
/// that shadows take none away. sites: gathered of the hits.
Rgb dark_share(std::span<const SurfaceHit> hits, const SiteBlock& sites);

/// Whether what the pixel carries is an object's.
bool belongs_to_object(const SampleState& state, std::size_t index);
/// Whether what the pixel carries is of what it sees now: a catcher does not start from an object's
/// memory, nor an object from a catcher's.
bool is_of_its_kind(bool sees_catcher, const SampleState& state, std::size_t index);

/// The sites on catchers of a pixel that belongs to an object.
class CatcherEdge {
 public:
  /// The share of the light that arrives, times that of the sites. input: the pixel's own.
  Rgb sample(const PixelMethod& method, const PixelInput& input, CatcherAlbedo& albedo,
             const PixelState& pixel);
  /// What paths from these sites begin with, after sample(); until the next one.
  BounceStart start(const PixelInput& input) const {
    return {sites_, hits_, input.presampled, key_of(input), {}};
  }

 private:
  /// Random numbers of pixels that no image has.
  static RngKey key_of(const PixelInput& input) {
    RngKey key = input.key;
    key.pixel ^= 0x80000000u;
    return key;
  }

  std::vector<SurfaceHit> hits_;
  SiteBlock sites_;
  AsideSampler aside_;
};

}  // namespace baton
