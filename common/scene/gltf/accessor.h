#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/gltf/document.h"

/// What lies in the buffers of a file. Errors name the accessor: past its view, of another type
/// than expected, sparse elements out of order or range.
namespace baton::gltf {

/// (count, width) floats; normalised integers become [0, 1] or [-1, 1].
Result<std::vector<float>> read_floats(const Document& document, int accessor, int width);
/// (count) whole numbers.
Result<std::vector<std::uint32_t>> read_indices(const Document& document, int accessor);

}  // namespace baton::gltf
