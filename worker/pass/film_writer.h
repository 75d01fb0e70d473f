#pragma once

#include <array>

#include "common/image/film_tile.h"
#include "common/image/noise.h"
#include "common/job/job_spec.h"
#include "common/state/sample_state.h"
#include "worker/method/pixel_method.h"

namespace baton {

/// All that is known of a finished pixel.
struct PixelResult {
  /// Reflected and background light, mean over the sites.
  Rgb radiance;
  float coverage = 0;  ///< share of the sites that see a surface
  /// Coverage, or 1 where the background is shown.
  float alpha = 0;
  float lns = 0;
  float visibility = 0;  ///< share of the weight whose rays are free
  float ess_ratio = 0;   ///< ESS / N
  float acceptance = 0;  ///< accepted moves / proposed moves
  float acceptance_local = 0,
        acceptance_independent = 0;  ///< acceptance by kind, 0 without moves
  float resampled = 0;               ///< 1 where it was
  PixelSource source = PixelSource::background;
  Rgb source_color{};  ///< colour by which `source` is shown
  /// Unit: mean shading normal of the sites that see a surface; else 0.
  Vec3 normal{};
  /// Mean distance of the sites that see a surface.
  float depth = 0;
  /// 1: all rays free, 0: some failed, 0.5: background [CV Fig. 2].
  float mask = 0.5f;
  /// Material at the first site that sees a surface: index in the scene + 1; 0: none.
  std::uint32_t material = 0;
  /// Estimated variance of `radiance` at its sites; 0 where it is not known.
  Rgb variance{};
  /// Light that shadows take away: `radiance` without them is the sum.
  Rgb blocked{};
  /// Part of `radiance` that came by other surfaces.
  Rgb indirect{};
  float error = kNoSurface;  ///< as in the plane kErrorChannel
  float rounds = 1;          ///< number of rounds in this mean
  /// Share of the light that arrives on the catcher, times `catcher`.
  Rgb shadow{};
  float catcher = 0;  ///< share of the sites that see it
};

/// Pass: writes pixels into the channels of the job: R, G, B, A, the AOVs in their order, and those
/// that frames have not: indirect.* (hides_indirect), shadow.* and kCatcherChannel where something
/// catches shadows, and where the noise is told kErrorChannel.
class FilmWriter {
 public:
  FilmWriter(const PixelRect& rect, const JobSpec& job);
  /// index: row by row inside the rectangle.
  void write(std::size_t index, const PixelResult& pixel);
  const FilmTile& film() const { return film_; }

 private:
  void write_hidden(std::size_t index, std::size_t channel, const PixelResult& pixel);

  FilmTile film_;
  std::vector<Aov> aovs_;
  bool with_indirect_, with_shadow_, with_error_;
};

/// False colour of a pixel's source: green carried, red fresh, yellow restarted, blue refreshed,
/// black background.
Rgb source_color(PixelSource source);

}  // namespace baton
