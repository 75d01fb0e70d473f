#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/scene/texture/image_reader.h"

namespace baton {

/// What an image says of a surface, and so which of its channels are kept.
enum class TextureUse : std::uint8_t {
  color,            ///< RGB; sRGB in files of integers
  color_and_alpha,  ///< the same with A
  /// RGB as of color, but as the file has it where that is multiplied by A.
  light,
  metallic_roughness,  ///< G and B, numbers
  normal,              ///< RGB, numbers
  red,                 ///< R, numbers
  green,               ///< G, numbers
};

/// R, G and B of each pixel as linear light; grey stands for all three. Floats are as in the file.
std::vector<float> linear_colors(const Image& image);

/// How an image goes on past its edges.
enum class Wrap : std::uint8_t {
  repeat,
  clamp,
  mirror,
};

/// How a texture is looked up.
struct TextureSampling {
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
  /// No blending of texels that are larger than the footprint.
  bool nearest = false;

  bool operator==(const TextureSampling&) const = default;
};

/// An image, or a smaller one that was made of it.
struct TextureLevel {
  std::int32_t width = 1, height = 1;
  /// Index of its first texel. Around the level lies a border one texel wide, of what the edge of
  /// the image is along it: texel (-1, y) is at first + y * stride() - 1.
  std::uint32_t first = 0;

  std::int32_t stride() const { return width + 2; }

  bool operator==(const TextureLevel&) const = default;
};

/// The texels of an image and its levels.
struct TexelArray {
  /// Texel by texel; a texel of four channels lies in the array wherever one of its own begins.
  const std::uint16_t* values;
  std::uint32_t channels;  ///< [1, 4]
  float scale;             ///< value of the number 1
};

/// Texels of an image with a channel, of those that are kept, that a texture cannot hold.
struct TextureRepairs {
  /// Negative, NaN or infinite: the channel counts as 0.
  std::uint64_t unusable = 0;
  /// Above the largest half float: the channel is cut to it.
  std::uint64_t too_bright = 0;
};
/// What is to be said of them, a line each.
std::vector<std::string> repair_notes(const TextureRepairs& repairs);

/// An image and its halves, quarters ... down to one texel, in memory, 2 bytes a channel. Each
/// texel of a smaller image is the mean of those that it covers, taken of linear light; beyond the
/// edge of each lies the edge of the image, not its own.
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
  const TextureRepairs& repairs() const { return repairs_; }
  std::size_t size_bytes() const { return 2 * texels_.size(); }
  std::span<const TextureLevel> levels() const { return levels_; }
  TexelArray texels() const {
    return {texels_.data(), static_cast<std::uint32_t>(channels_), scale_};
  }
  bool has_size_of(const Texture& other) const {
    return width() == other.width() && height() == other.height();
  }

  /// One texel; for tests.
  std::array<float, 4> texel(std::int32_t level, std::int32_t x, std::int32_t y) const;

 private:
  struct Level;
  void append_level(const Level& level);

  TextureRepairs repairs_;
  std::int32_t channels_ = 0;
  float scale_ = 0;  ///< value of the number 1
  std::vector<TextureLevel> levels_;
  std::vector<std::uint16_t> texels_;  ///< then three more, which belong to none
};

}  // namespace baton
