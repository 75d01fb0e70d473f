#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/image/color_choice.h"
#include "common/image/color_space.h"
#include "common/image/film_tile.h"

namespace baton {

/// What of an EXR file is read. data: all that it has. display: what it shows, 0 where its data
/// does not reach, such as around what compositors cut to its content. seen: of what it shows the
/// part that its data reaches, all if none does: a frame of a part of the image is that part.
enum class ExrWindow : std::uint8_t { data, display, seen };

/// What the header of a part says; of one that is not flat no channels.
struct ExrPart {
  PartLayout layout;
  PixelRect data, display;
  std::optional<Chromaticities> chromaticities;
};
/// The parts of an EXR file, one at least. Errors: those of read_exr.
Result<std::vector<ExrPart>> read_exr_parts(const std::filesystem::path& path);

/// Like read_exr (image_io.h), but only channels of one part, by their names in the file: the
/// others cost neither memory nor conversion. Errors: those of read_exr.
Result<FilmTile> read_exr_part(const std::filesystem::path& path, std::size_t part,
                               const std::vector<std::string>& channels, ExrWindow window);
/// R, G, B and A of luminance and chroma, in the first part; layer: without its dot, or empty.
Result<FilmTile> read_exr_luma_chroma(const std::filesystem::path& path, const std::string& layer,
                                      ExrWindow window);

}  // namespace baton
