#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "worker/texture/image_reader.h"

namespace baton {

/// What an image says of a surface, and so which of its channels are kept.
enum class TextureUse : std::uint8_t {
  color,               ///< RGB; sRGB in files of integers
  color_and_alpha,     ///< the same with A
  metallic_roughness,  ///< G and B, numbers
  normal,              ///< RGB, numbers
  red,                 ///< R, numbers
  green,               ///< G, numbers
};

/// How an image goes on past its edges.
enum class Wrap : std::uint8_t { repeat, clamp, mirror };

/// How a texture is looked up.
struct TextureSampling {
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
  bool nearest = false;  ///< no blending of texels that are larger than the footprint
};

/// The parallelogram that a look-up is the mean over: two edges, in units of the whole image. All
/// 0: a point.
struct Footprint {
  std::array<float, 2> a{}, b{};
};

/// An image and its halves, quarters ... down to one texel, in memory, 2 bytes a channel. Each
/// texel of a smaller image is the mean of those that it covers, taken of linear light.
/// Immutable; any number of threads may look it up.
class Texture {
 public:
  /// Error: too few channels for its use.
  static Result<std::shared_ptr<const Texture>> build(const Image& image, TextureUse use,
                                                      const std::string& name);

  std::int32_t width() const { return levels_.front().width; }
  std::int32_t height() const { return levels_.front().height; }
  std::int32_t num_levels() const { return static_cast<std::int32_t>(levels_.size()); }
  bool has_alpha() const { return channels_ == 4; }
  std::size_t size_bytes() const { return 2 * texels_.size(); }

  /// The mean over a footprint around (u, v); (0, 0) is the upper left corner of the image, (1, 1)
  /// the lower right. Channels as of TextureUse; those that are not kept are 0. Up to 16 blends of
  /// two levels lie along the footprint's longer side.
  std::array<float, 4> look_up(std::array<float, 2> uv, const Footprint& footprint,
                               const TextureSampling& sampling) const;
  /// One texel; for tests.
  std::array<float, 4> texel(std::int32_t level, std::int32_t x, std::int32_t y) const;

 private:
  struct Level {
    std::int32_t width, height;
    std::size_t first;  ///< of its values
  };
  void append_level(const std::vector<float>& values, std::int32_t width, std::int32_t height);
  template <std::size_t kChannels>
  void add_channels(const Level& level, std::array<float, 2> uv, const TextureSampling& sampling,
                    float weight, std::array<float, 4>& sum) const;
  void add(const Level& level, std::array<float, 2> uv, const TextureSampling& sampling,
           float weight, std::array<float, 4>& sum) const;

  std::int32_t channels_ = 0;
  float scale_ = 0;  ///< value of the number 1
  std::vector<Level> levels_;
  std::vector<std::uint16_t> texels_;
};

}  // namespace baton
