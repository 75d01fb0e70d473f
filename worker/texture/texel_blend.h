#pragma once

#include <array>
#include <cstdint>

namespace baton {

/// How an image goes on past its edges.
enum class Wrap : std::uint8_t { repeat, clamp, mirror };

/// How a texture is looked up.
struct TextureSampling {
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
  bool nearest = false;  ///< no blending of texels that are larger than the footprint

  bool operator==(const TextureSampling&) const = default;
};

/// An image, or a smaller one that was made of it.
struct TextureLevel {
  std::int32_t width = 1, height = 1;
  std::uint32_t first = 0;  ///< its first texel, counted from that of the image

  bool operator==(const TextureLevel&) const = default;
};

/// Blends along the longer side of a footprint.
inline constexpr int kMostProbes = 16;

/// Points along the middle of a footprint whose mean is looked up; each blends two levels.
struct ProbeLine {
  std::array<float, 2> middle{}, along{};  ///< in units of the whole image
  int num_probes = 1;                      ///< [1, kMostProbes]
  TextureLevel fine, coarse;
  float blend = 0;          ///< share of the coarse level, [0, 1)
  bool is_smaller = false;  ///< texels are smaller than the footprint: always blended
};

/// The texels of an image and its levels.
struct TexelArray {
  /// Texel by texel; a texel of four channels lies in the array wherever one of its own begins.
  const std::uint16_t* values;
  std::uint32_t channels;  ///< [1, 4]
  float scale;             ///< value of the number 1
};

}  // namespace baton
