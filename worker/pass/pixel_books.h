#pragma once

#include <cstddef>
#include <span>

#include "common/job/task.h"
#include "worker/accel/accel.h"
#include "worker/method/pixel_method.h"
#include "worker/pass/film_writer.h"

namespace baton {

/// Sets what does not depend on light: coverage, mean normal and depth over the sites (S) of a
/// pixel, and the material of the first that sees a surface.
void record_geometry(std::span<const SurfaceHit> hits, PixelResult& pixel);

/// Enters what a method said about its work on a pixel whose source is set.
void record_sampling(const PixelDiagnostics& did, PixelResult& pixel, SamplingStats& stats);

}  // namespace baton
