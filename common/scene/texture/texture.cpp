#include "common/scene/texture/texture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace baton {
namespace {

constexpr float kFullScale = 65535;
/// Texels are read four channels at a time.
constexpr std::size_t kTexelPadding = 3;
/// Brighter values of images of floats are cut.
constexpr float kBrightest = 65504;

/// Entries of the table of sRGB: the values of integers of 8 or 16 bits.
constexpr std::size_t kTableSize = 65536;

/// IEC 61966-2-1.
float decode_srgb(float v) {
  return v <= 0.04045f ? v / 12.92f : std::pow((v + 0.055f) / 1.055f, 2.4f);
}

/// A channel that an image lacks: 0.
constexpr std::int32_t kNone = -1;

bool is_color(TextureUse use) {
  return use == TextureUse::color || use == TextureUse::color_and_alpha || use == TextureUse::light;
}

/// The channels of an image that a use keeps.
std::vector<std::int32_t> kept_channels(TextureUse use, const Image& image) {
  const bool is_grey = image.num_colors() == 1;
  const std::int32_t blue = image.num_colors() > 2 ? 2 : kNone;
  switch (use) {
    case TextureUse::color:
    case TextureUse::light:
    case TextureUse::normal:
      return is_grey ? std::vector{0, 0, 0} : std::vector{0, 1, blue};
    case TextureUse::color_and_alpha: {
      std::vector<std::int32_t> kept = kept_channels(TextureUse::color, image);
      if (image.has_alpha) kept.push_back(image.channels - 1);
      return kept;
    }
    case TextureUse::metallic_roughness:
      return is_grey ? std::vector{0, 0} : std::vector{1, blue};
    case TextureUse::red:
      return {0};
    case TextureUse::green:
      return {is_grey ? 0 : 1};
  }
  return {};
}

/// Values of the kept channels, colours as linear light.
std::vector<float> linear_values(const Image& image, TextureUse use) {
  const std::vector<std::int32_t> kept = kept_channels(use, image);
  const bool is_srgb = image.is_integer && is_color(use);
  const auto channels = static_cast<std::size_t>(image.channels);
  std::vector<float> light(is_srgb ? kTableSize : 0);
  for (std::size_t i = 0; i < light.size(); ++i)
    light[i] = decode_srgb(static_cast<float>(i) / static_cast<float>(kTableSize - 1));
  std::vector<float> values;
  values.reserve(image.samples.size() / channels * kept.size());
  for (std::size_t pixel = 0; pixel < image.samples.size(); pixel += channels) {
    for (std::size_t k = 0; k < kept.size(); ++k) {
      const float v =
          kept[k] == kNone ? 0.0f : image.samples[pixel + static_cast<std::size_t>(kept[k])];
      const auto step = [&] {  // in [0, 1]
        return static_cast<std::size_t>(v * static_cast<float>(kTableSize - 1) + 0.5f);
      };
      values.push_back(is_srgb && k < 3 ? light[std::min(step(), kTableSize - 1)] : v);
    }
  }
  return values;
}

/// Makes values, (texels, channels), what a texture can hold.
TextureRepairs limit(std::vector<float>& values, std::size_t channels) {
  TextureRepairs repairs;
  for (std::size_t texel = 0; texel < values.size(); texel += channels) {
    bool is_unusable = false, is_too_bright = false;
    for (float& v : std::span(values).subspan(texel, channels)) {
      const bool is_usable = v >= 0 && std::isfinite(v);
      is_unusable = is_unusable || !is_usable;
      is_too_bright = is_too_bright || (is_usable && v > kBrightest);
      v = is_usable ? std::min(v, kBrightest) : 0;
    }
    repairs.unusable += is_unusable ? 1 : 0;
    repairs.too_bright += is_too_bright ? 1 : 0;
  }
  return repairs;
}

}  // namespace

std::vector<std::string> repair_notes(const TextureRepairs& repairs) {
  std::vector<std::string> notes;
  if (repairs.unusable > 0)
    notes.push_back(
        fmt::format("{} texels are negative, NaN or infinite and count as 0", repairs.unusable));
  if (repairs.too_bright > 0)
    notes.push_back(
        fmt::format("{} texels are brighter than {} and cut", repairs.too_bright, kBrightest));
  return notes;
}

std::vector<float> linear_colors(const Image& image) {
  return linear_values(image, TextureUse::light);
}

namespace {

/// Half as many samples along one axis, each the mean of the stretch that it covers. values:
/// (outer, count, inner).
std::vector<float> halve(const std::vector<float>& values, std::size_t count, std::size_t inner) {
  const std::size_t half = std::max<std::size_t>(count / 2, 1);
  if (half == count) return values;
  const std::size_t outer = values.size() / (count * inner);
  std::vector<float> result(outer * half * inner);
  // An odd number of texels splits the last ones between two: the shares of 2n + 1 texels are in
  // units of 1 / n.
  const std::size_t unit = count % 2 == 0 ? 1 : half, width = count % 2 == 0 ? 2 : count;
  for (std::size_t o = 0; o < outer; ++o) {
    for (std::size_t i = 0; i < half; ++i) {
      const std::size_t begin = i * width, end = begin + width;
      for (std::size_t t = begin / unit; t * unit < end; ++t) {
        const std::size_t covered = std::min(end, (t + 1) * unit) - std::max(begin, t * unit);
        const float share = static_cast<float>(covered) / static_cast<float>(width);
        const float* const from = values.data() + (o * count + t) * inner;
        float* const to = result.data() + (o * half + i) * inner;
        for (std::size_t k = 0; k < inner; ++k) to[k] += share * from[k];
      }
    }
  }
  return result;
}

}  // namespace

/// A level in the making, and the edges of the image as long as those of the level.
struct Texture::Level {
  std::int32_t width, height;
  std::size_t channels;
  std::vector<float> values;                    ///< (height, width, channels)
  std::vector<float> top, bottom, left, right;  ///< (width or height, channels)
  /// (4, channels): top left and right, below left and right.
  std::vector<float> corners;

  static Level of_image(std::int32_t width, std::int32_t height, std::size_t channels,
                        std::vector<float> values) {
    Level level{width, height, channels, std::move(values), {}, {}, {}, {}, {}};
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    const auto add = [&](std::size_t x, std::size_t y, std::vector<float>& edge) {
      const float* const texel = level.values.data() + (y * w + x) * channels;
      edge.insert(edge.end(), texel, texel + channels);
    };
    for (std::size_t x = 0; x < w; ++x) {
      add(x, 0, level.top);
      add(x, h - 1, level.bottom);
    }
    for (std::size_t y = 0; y < h; ++y) {
      add(0, y, level.left);
      add(w - 1, y, level.right);
    }
    for (const std::size_t y : {std::size_t{0}, h - 1}) {
      add(0, y, level.corners);
      add(w - 1, y, level.corners);
    }
    return level;
  }

  void halve() {
    const auto w = static_cast<std::size_t>(width), h = static_cast<std::size_t>(height);
    for (std::vector<float>* edge : {&top, &bottom, &values})
      *edge = baton::halve(*edge, w, channels);
    width = std::max(width / 2, 1);
    for (std::vector<float>* edge : {&left, &right}) *edge = baton::halve(*edge, h, channels);
    values = baton::halve(values, h, static_cast<std::size_t>(width) * channels);
    height = std::max(height / 2, 1);
  }
};

Result<std::shared_ptr<const Texture>> Texture::build(const Image& image, TextureUse use,
                                                      const std::string& name) {
  if (use == TextureUse::normal && image.num_colors() < 3)
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: expected red, green and blue of a normal map, got {} channels",
                             name, image.channels)};
  const std::size_t num_kept = kept_channels(use, image).size();
  auto texture = std::make_shared<Texture>();
  texture->channels_ = static_cast<std::int32_t>(num_kept);
  std::vector<float> values = linear_values(image, use);
  texture->repairs_ = limit(values, num_kept);
  const float brightest = *std::max_element(values.begin(), values.end());
  texture->scale_ = std::max(brightest, 1.0f) / kFullScale;

  Level level = Level::of_image(image.width, image.height, num_kept, std::move(values));
  texture->append_level(level);
  while (level.width > 1 || level.height > 1) {
    level.halve();
    texture->append_level(level);
  }
  texture->texels_.resize(texture->texels_.size() + kTexelPadding);
  return std::shared_ptr<const Texture>(std::move(texture));
}

void Texture::append_level(const Level& level) {
  const std::size_t stride = static_cast<std::size_t>(level.width) + 2;
  const std::size_t begin = texels_.size() / level.channels;
  levels_.push_back({level.width, level.height, static_cast<std::uint32_t>(begin + stride + 1)});
  texels_.reserve(texels_.size() +
                  stride * (static_cast<std::size_t>(level.height) + 2) * level.channels);
  const auto append = [&](const float* values, std::size_t count) {
    for (std::size_t i = 0; i < count * level.channels; ++i)
      texels_.push_back(
          static_cast<std::uint16_t>(std::lround(std::min(values[i] / scale_, kFullScale))));
  };
  const std::size_t c = level.channels, row = static_cast<std::size_t>(level.width);
  const auto append_row = [&](const float* left, const float* middle, const float* right) {
    append(left, 1);
    append(middle, row);
    append(right, 1);
  };
  append_row(level.corners.data(), level.top.data(), level.corners.data() + c);
  for (std::size_t y = 0; y < static_cast<std::size_t>(level.height); ++y)
    append_row(level.left.data() + y * c, level.values.data() + y * row * c,
               level.right.data() + y * c);
  append_row(level.corners.data() + 2 * c, level.bottom.data(), level.corners.data() + 3 * c);
}

std::array<float, 4> Texture::texel(std::int32_t level, std::int32_t x, std::int32_t y) const {
  const TextureLevel& l = levels_[static_cast<std::size_t>(level)];
  const std::size_t at =
      static_cast<std::size_t>(static_cast<std::int32_t>(l.first) + y * l.stride() + x) *
      static_cast<std::size_t>(channels_);
  std::array<float, 4> value{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(channels_); ++c)
    value[c] = static_cast<float>(texels_[at + c]) * scale_;
  return value;
}

}  // namespace baton
