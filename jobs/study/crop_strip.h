#pragma once

#include <array>
#include <span>

#include "jobs/study/measured_frame.h"

namespace baton {

/// The same part of several images side by side: the reference and the tests above, below each test
/// its FLIP against the reference from black (0) over violet and orange to pale yellow (1). crop:
/// x, y, width, height in pixels, inside of the images. Small crops are enlarged by whole factors
/// to at least 160 pixels.
RgbImage crop_strip(const Reference& reference, std::span<const MeasuredFrame> tests,
                    const std::array<int, 4>& crop);

}  // namespace baton
