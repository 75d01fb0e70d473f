#pragma once

#include <array>

#include "worker/method/carried/old_surfaces.h"
#include "worker/pass/reproject.h"
#include "worker/pass/tile_round.h"

namespace baton {

/// Stage: what the samples of each pixel start from. It works one pixel ahead.
class PixelStarts {
 public:
  PixelStarts(const FrameGeometry& geometry, RoundWork& work) : geometry_(geometry), work_(work) {}

  /// Looks for the pixels of a batch in the frame before, and fills their blocks in `state`.
  void begin(const PixelBatch& batch, SampleState& state);
  /// What pixel i of the batch, in `slot`, which sees a surface, carries in `state` becomes what
  /// the frame before left. Returns whether there is any.
  bool find(std::size_t i, std::size_t slot, SampleState& state);
  /// Holds for the pixel that was found last or the one before it, until the next call of find().
  PixelStart of(std::size_t i);

 private:
  struct Found {
    PixelHistory history = PixelHistory::none;
    OldSurfaces old;  ///< for `moved`
  };
  PixelHistory with_old_albedo(std::size_t slot, OldSurfaces& old);

  const FrameGeometry& geometry_;
  RoundWork& work_;
  std::array<Found, 2> found_;  ///< one for even numbers, one for odd ones
};

}  // namespace baton
