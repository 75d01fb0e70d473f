#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "worker/texture/image_reader.h"
#include "worker/texture/texel_blend.h"

namespace baton {

/// What an image says of a surface, and so which of its channels are kept.
enum class TextureUse : std::uint8_t {
  color,               ///< RGB; sRGB in files of integers
  color_and_alpha,     ///< the same with A
  light,               ///< RGB as of color, but as the file has it where that is multiplied by A
  metallic_roughness,  ///< G and B, numbers
  normal,              ///< RGB, numbers
  red,                 ///< R, numbers
  green,               ///< G, numbers
};

/// R, G and B of each pixel as linear light; grey stands for all three. Floats are as in the file.
std::vector<float> linear_colors(const Image& image);

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
  bool has_size_of(const Texture& other) const {
    return width() == other.width() && height() == other.height();
  }

  /// The mean over a footprint around (u, v); (0, 0) is the upper left corner of the image, (1, 1)
  /// the lower right. Channels as of TextureUse; those that are not kept are 0. Up to 16 blends of
  /// two levels lie along the footprint's longer side.
  std::array<float, 4> look_up(std::array<float, 2> uv, const Footprint& footprint,
                               const TextureSampling& sampling) const;
  /// One texel; for tests.
  std::array<float, 4> texel(std::int32_t level, std::int32_t x, std::int32_t y) const;

 private:
  friend void look_up_together(std::span<const Texture* const> images, std::array<float, 2> uv,
                               const Footprint& footprint, const TextureSampling& sampling,
                               std::span<std::array<float, 4>> means);

  void append_level(const std::vector<float>& values, std::int32_t width, std::int32_t height);
  ProbeLine probe_line(std::array<float, 2> uv, const Footprint& footprint) const;
  TexelArray texels() const {
    return {texels_.data(), static_cast<std::uint32_t>(channels_), scale_};
  }

  std::int32_t channels_ = 0;
  float scale_ = 0;  ///< value of the number 1
  std::vector<TextureLevel> levels_;
  std::vector<std::uint16_t> texels_;  ///< then three more, which belong to none
};

/// The means of several images at one place, as look_up has them. Those of one size that follow
/// each other are looked up at little more than the price of one. means: a place for each.
void look_up_together(std::span<const Texture* const> images, std::array<float, 2> uv,
                      const Footprint& footprint, const TextureSampling& sampling,
                      std::span<std::array<float, 4>> means);

}  // namespace baton
