#include "common/scene/texture/image_colors.h"

#include "common/image/color_space.h"

namespace baton {
namespace {

void divide_by_alpha(Image& image) {
  const auto channels = static_cast<std::size_t>(image.channels);
  for (std::size_t i = 0; i < image.samples.size(); i += channels) {
    const float alpha = image.samples[i + channels - 1];
    for (std::size_t c = 0; alpha > 0 && c + 1 < channels; ++c) image.samples[i + c] /= alpha;
  }
}

}  // namespace

Status to_linear_colors(Image& image, TextureUse use, const std::string& name) {
  const bool is_base = use == TextureUse::color || use == TextureUse::color_and_alpha;
  if (!is_base && use != TextureUse::light) return {};
  if (is_base && image.has_alpha && image.is_associated) divide_by_alpha(image);
  if (!image.chromaticities || image.num_colors() < 3) return {};

  const auto& xy = *image.chromaticities;
  const Chromaticities space{.red = {xy[0], xy[1]},
                             .green = {xy[2], xy[3]},
                             .blue = {xy[4], xy[5]},
                             .white = {xy[6], xy[7]}};
  const Status done = convert_to_rec709(image.samples, static_cast<std::size_t>(image.channels),
                                        {.chromaticities = space});
  if (!done) return Error{done.error().kind, name + ": " + done.error().message};
  return {};
}

}  // namespace baton
