#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/pass/render_context.h"

namespace baton {

/// A pixel of the image: x, y.
using PixelPlace = std::array<std::int32_t, 2>;

/// The number of sites S of pixels: image.sites, or 4, 16, ... times as many, at most
/// image.maxSites, where what limits::kGeometryProbes rays of their own, which are in no image, see
/// asks for it. A pure function of (job, pose of the frame, pixel), in which no site of the image
/// has a part: so S cannot bias. Only where has_fine_sites(job).
std::vector<std::uint16_t> count_sites(const JobSpec& job, const FrameGeometry& geometry,
                                       std::span<const PixelPlace> pixels);

/// How much one site may differ from its pixel, as a share of what it reflects, [0, 1]: 0 for a
/// plane, 1 for an edge. It adds up the spread of the normals, times how sharply the material
/// reflects, and that of the albedo. hits: of a pixel's probes.
float site_contrast(const FrameGeometry& geometry, std::span<const SurfaceHit> hits);

}  // namespace baton
