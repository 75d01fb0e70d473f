#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/scene/gltf/document.h"

/// What lies in the buffers of a file. Errors name the accessor: past its view, of another type
/// than expected, sparse elements out of order or range.
namespace baton::gltf {

/// (count, width) floats as the file has them, finite or not; normalised integers become [0, 1] or
/// [-1, 1].
Result<std::vector<float>> read_floats(const Document& document, int accessor, int width);
/// (count) whole numbers.
Result<std::vector<std::uint32_t>> read_indices(const Document& document, int accessor);

/// Whether all numbers of an element, row `index` of (count, width), are finite: an element of
/// which one is not is left out where it is used, and counted there.
bool is_finite(std::span<const float> values, std::size_t width, std::size_t index);

}  // namespace baton::gltf
