#pragma once

#include <vector>

#include "worker/exchange/pixel_mask.h"
#include "worker/exchange/surface_table.h"
#include "worker/pass/render_context.h"

namespace baton {

/// What the sites of the pixels of a mask see, traced again exactly as in the first pass.
class MaskedSurfaces {
 public:
  MaskedSurfaces(const RenderContext& context, const FrameGeometry& geometry,
                 const PixelMask& mask);

  /// Position of a masked pixel among them; `index` as PixelMask::index. Negative for the others.
  std::int32_t find(std::size_t index) const { return position_[index]; }
  /// Sites of the pixel at `position`: (S), and in the table from position * S.
  std::span<const SurfaceHit> hits(std::int32_t position) const;
  const SurfaceTable& table() const { return table_; }
  std::size_t num_rays() const { return rays_.size(); }
  /// CPU time of tracing them.
  double seconds_rays() const { return seconds_rays_; }
  /// Radiance of the environment that the pixel shows past its surfaces, mean over the sites.
  Rgb background(std::int32_t position, const Environment& environment) const;
  /// Radiance that the surfaces of a pixel emit, mean over the sites.
  Rgb emission(std::int32_t position) const {
    return emission_[static_cast<std::size_t>(position)];
  }

 private:
  std::size_t num_sites_;
  std::vector<std::int32_t> position_;  ///< PixelMask::ranks
  std::vector<Ray> rays_;               ///< (masked pixels, S)
  std::vector<SurfaceHit> hits_;        ///< (masked pixels, S)
  std::vector<Rgb> emission_;           ///< (masked pixels)
  SurfaceTable table_;                  ///< (masked pixels, S)
  double seconds_rays_ = 0;
};

}  // namespace baton
