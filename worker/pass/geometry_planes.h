#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/image/film_tile.h"
#include "worker/pass/primary.h"
#include "worker/pass/render_context.h"

namespace baton {

/// The AOVs of a film that follow from what sites see, summed over the rounds of a frame: albedo,
/// position, z, motion, object and the ID mattes. Nothing where the job has none of them.
class GeometryPlanes {
 public:
  /// Planes of a tile in a frame. rect: its pixels.
  GeometryPlanes(const RenderContext& context, const FrameSpec& frame,
                 const FrameGeometry& geometry, const PixelRect& rect);

  /// Whether the job has such AOVs.
  bool is_empty() const { return sums_.empty(); }

  /// Adds the sites of a round, each with the weight of its pixel.
  void add(const TileSurfaces& surfaces);
  /// Writes the means into the planes of the film.
  void write(FilmTile& film) const;

 private:
  /// The sums of one pixel over the sites that see a surface; motion: over all sites.
  struct Sum {
    std::array<double, 3> albedo{}, position{};
    double z = 0;
    std::array<double, 4> motion{};
    /// Object at the first site that sees one: number from 1; 0: none.
    std::uint32_t object = 0;
    double seen = 0;   ///< weight of the sites that see a surface
    double sites = 0;  ///< weight of all sites
  };
  /// The things that one pixel sees, and with how many sites. The first kMostThings are kept.
  static constexpr std::size_t kMostThings = 8;
  struct Things {
    std::array<std::uint32_t, kMostThings> thing{};  ///< number from 1; 0: none
    std::array<double, kMostThings> sites{};         ///< their weight

    void add(std::uint32_t number, double weight);
  };

  void add_motion(const Camera& camera, const Ray& ray, const SurfaceHit& hit, double weight,
                  Sum& sum) const;
  void write_ids(const std::vector<Things>& things, const std::vector<std::string>& names,
                 Aov layer, FilmTile& film) const;
  bool has(Aov aov) const;

  const RenderContext& context_;
  const FrameGeometry& geometry_;
  /// Poses at the frame numbers one less and one more; only for motion.
  Pose before_, after_;
  std::vector<Sum> sums_;
  std::vector<Things> objects_, materials_;  ///< (pixels), or empty
  std::vector<std::string> object_names_;    ///< only for mattes, as the next
  /// By object: number of the first that is named alike.
  std::vector<std::uint32_t> first_parts_;
};

}  // namespace baton
