#pragma once

#include <optional>
#include <span>
#include <vector>

#include "worker/accel/geometry_sequence.h"
#include "worker/method/carried/old_surfaces.h"
#include "worker/pass/neighborhood.h"
#include "worker/pass/old_pixels.h"
#include "worker/pass/primary.h"

namespace baton {

/// What a pixel has of the frame before.
enum class PixelHistory {
  none,   ///< nothing: it starts afresh
  same,   ///< samples of the same surfaces
  moved,  ///< samples of other surfaces
};

/// Pass: follows each pixel back to where its surface was in the frame before [SS section 6, but
/// gathering, so that nothing collides]: a hit of the object in front, drawn at random so that
/// motion by fractions of a pixel is followed on average, goes back with its object and is
/// projected by the camera of then. (Where geometry is fine: of the first image.sites sites, which
/// are spread over the pixel.) The samples of that pixel are taken when each site of now finds a
/// site of then that saw the same object at about the same place and turned about the same way, and
/// each of then is found; else there is no history. Neighbours, where the method uses them, are
/// found around the same place.
class Reprojection {
 public:
  /// states: of the frame before, of every tile within reach. All must outlive the object.
  Reprojection(const RenderContext& context, const FrameGeometry& now, const FrameGeometry& before,
               std::span<const StatePtr> states);

  /// Finds the history of pixels of `surfaces`, by their slots. frame: the user's number.
  void look_up(const TileSurfaces& surfaces, std::span<const std::uint32_t> slots,
               const FrameSpec& frame);
  /// Fills what the blocks of these pixels carry, each from the blocks that its pixels come from.
  /// slots: of the last look_up, the pixels of a block side by side.
  void inherit_blocks(const TileSurfaces& surfaces, std::span<const std::uint32_t> slots,
                      SampleState& state) const;
  /// Copies the samples that pixel i of the last look_up takes over to pixel `pixel` of
  /// `state`. `old` is filled for `moved`. catchers: of the frame before.
  PixelHistory take(std::size_t i, std::size_t pixel, CatcherAlbedo& catchers, SampleState& state,
                    OldSurfaces& old) const;

  /// What the neighbours of pixel i carry, until the next call.
  std::span<const CarriedSet> neighbors(std::size_t i, CatcherAlbedo& catchers);

  /// Rays traced so far.
  std::uint64_t num_rays() const { return old_pixels_.num_rays(); }

 private:
  struct Position {
    std::int32_t x = 0, y = 0;
  };
  /// For each site of now, the site of then that it inherits from; and how many inherit from a site
  /// of then.
  struct Inheritance {
    std::array<std::uint8_t, limits::kMaxSites> from{};
    std::array<std::uint8_t, limits::kMaxSites> count{};
  };
  /// A pixel and where its history lies.
  struct Slot {
    std::span<const SurfaceHit> hits;  ///< what it sees now
    RngKey key;
    std::optional<OldPixels::Place> old;  ///< none: no history
    bool same_pixel = false;
    PixelHistory history = PixelHistory::none;
    Inheritance inheritance{};  ///< where history is `moved`
  };

  std::optional<Position> find_source(std::span<const SurfaceHit> hits, const Position& pixel,
                                      const Rng& rng) const;
  bool agrees(const SurfaceHit& now, const SurfaceHit& old) const;
  std::optional<Inheritance> inherit(std::span<const SurfaceHit> now,
                                     std::span<const SurfaceHit> old) const;
  static std::uint8_t find_heir(std::span<const SurfaceHit> hits, const Inheritance& inheritance,
                                std::uint8_t old_site, std::uint32_t k);
  void judge(Slot& slot) const;
  void copy_samples(const Slot& slot, std::size_t pixel, SampleState& state) const;

  const RenderContext& context_;
  const FrameGeometry& now_;
  const FrameGeometry& before_;
  OldPixels old_pixels_;
  std::optional<Neighborhood> neighborhood_;  ///< where the job asks neighbours
  const float cos_normal_tolerance_;
  const bool still_camera_;
  std::vector<Slot> slots_;
};

}  // namespace baton
