#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/image/color_space.h"
#include "common/image/film_tile.h"

namespace baton {

/// What of an EXR file is read. data: all that it has. display: what it shows, 0 where its data
/// does not reach, such as around what compositors cut to its content. seen: of what it shows the
/// part that its data reaches, all if none does: a frame of a part of the image is that part.
enum class ExrWindow : std::uint8_t { data, display, seen };
/// The channels wanted of those that a file has, by name.
using ChannelChoice =
    std::function<Result<std::vector<std::string>>(const std::vector<std::string>& all)>;

/// Like read_exr (image_io.h), but only the chosen channels, in the order of the choice: the others
/// cost neither memory nor conversion. Errors: those of read_exr and of the choice.
Result<FilmTile> read_exr_channels(const std::filesystem::path& path, const ChannelChoice& choose,
                                   ExrWindow window = ExrWindow::data);

/// The chromaticities that the header of an EXR file says, and those of Rec. 709 where it says none
/// or has no colours.
Result<PictureColors> read_exr_colors(const std::filesystem::path& path);

}  // namespace baton
