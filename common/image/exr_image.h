#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/image/color_space.h"
#include "common/image/exr_channels.h"
#include "common/image/pixel_limit.h"

namespace baton {

/// The colours of an EXR file, row by row from the top, channels interleaved.
struct ExrImage {
  std::int32_t width = 0, height = 0;
  /// One of grey or up to three colours, then alpha.
  std::int32_t channels = 0;
  bool has_alpha = false;
  std::vector<float> samples;  ///< (height * width * channels), as stored
  /// What the header says of the colours; none: nothing.
  std::optional<Chromaticities> chromaticities;
  /// For people, a line each: a choice, what counts as unknown.
  std::vector<std::string> notes;

  std::int32_t num_colors() const { return channels - (has_alpha ? 1 : 0); }
};

/// Reads what color_choice.h chooses of the file's parts, layers and channels. any: where nothing
/// has the name of a colour, its first channels. Errors: those of read_exr_channels, no colours,
/// luminance and chroma in another part than the first, more pixels than `limit` has.
Result<ExrImage> read_exr_image(const std::filesystem::path& path, ExrWindow window,
                                bool any = false, const PixelLimit& limit = {});

/// What its numbers are; Rec. 709 where the header says nothing or the picture is grey.
Result<ImageColors> read_exr_image_colors(const std::filesystem::path& path);

}  // namespace baton
