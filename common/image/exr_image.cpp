#include "common/image/exr_image.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace baton {
namespace {

/// What is read of a file, and what its header says of it.
struct Chosen {
  ColorChoice choice;
  PixelRect data, display;  ///< of its part
  std::optional<Chromaticities> chromaticities;
};

Result<Chosen> choose(const std::filesystem::path& path, bool any) {
  BATON_ASSIGN(const std::vector<ExrPart> parts, read_exr_parts(path));
  std::vector<PartLayout> layouts;
  std::vector<std::string> all;
  for (const ExrPart& part : parts) {
    layouts.push_back(part.layout);
    all.insert(all.end(), part.layout.channels.begin(), part.layout.channels.end());
  }
  if (all.empty())
    return Error{ErrorKind::bad_input, fmt::format("{}: expected a flat image", path.string())};
  std::optional<ColorChoice> choice = choose_colors(layouts);
  if (!choice && any && !layouts[0].channels.empty()) choice = any_channels(layouts);
  if (!choice)
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: no colours among {}, expected R, G, B or one channel",
                             path.string(), fmt::join(all, ", "))};
  std::optional<Chromaticities> said = parts[choice->part].chromaticities;
  if (said && is_unknown(*said)) {
    choice->notes.push_back("chromaticities of 0 count as unknown");
    said.reset();
  }
  const ExrPart& part = parts[choice->part];
  return Chosen{std::move(*choice), part.data, part.display, said};
}

Result<FilmTile> read_planes(const std::filesystem::path& path, const ColorChoice& choice,
                             ExrWindow window) {
  if (choice.is_luma_chroma) {
    if (choice.part > 0)
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: luminance and chroma in part {}, expected them in the first",
                               path.string(), choice.part + 1)};
    const std::string& y = choice.colors[0];
    return read_exr_luma_chroma(path, y.substr(0, std::max<std::size_t>(y.size(), 2) - 2), window);
  }
  std::vector<std::string> channels;
  for (const std::string& color : choice.colors) {
    if (!color.empty()) channels.push_back(color);
  }
  if (!choice.alpha.empty()) channels.push_back(choice.alpha);
  return read_exr_part(path, choice.part, channels, window);
}

}  // namespace

Result<ExrImage> read_exr_image(const std::filesystem::path& path, ExrWindow window, bool any,
                                const PixelLimit& limit) {
  BATON_ASSIGN(Chosen chosen, choose(path, any));
  for (const PixelRect& taken : {chosen.data, chosen.display})
    BATON_TRY(limit.check(taken.width(), taken.height(), path.string()));
  const ColorChoice& choice = chosen.choice;
  BATON_ASSIGN(const FilmTile film, read_planes(path, choice, window));
  ExrImage image{.width = film.rect.width(),
                 .height = film.rect.height(),
                 .channels = 0,
                 .has_alpha = !choice.alpha.empty(),
                 .samples = {},
                 .chromaticities = chosen.chromaticities,
                 .notes = choice.notes};

  // Interleave; a colour that is not there is 0.
  std::vector<const float*> planes;
  std::size_t next = 0;
  for (const std::string& color : choice.colors)
    planes.push_back(color.empty() ? nullptr : film.plane(next++));
  if (image.has_alpha) planes.push_back(film.plane(next));
  image.channels = static_cast<std::int32_t>(planes.size());
  image.samples.resize(film.num_pixels() * planes.size());
  for (std::size_t c = 0; c < planes.size(); ++c) {
    if (planes[c] == nullptr) continue;
    for (std::size_t i = 0; i < film.num_pixels(); ++i)
      image.samples[i * planes.size() + c] = planes[c][i];
  }
  return image;
}

Result<ImageColors> read_exr_image_colors(const std::filesystem::path& path) {
  BATON_ASSIGN(const Chosen chosen, choose(path, false));
  const bool has_colors = chosen.choice.colors.size() > 1 && chosen.chromaticities;
  return ImageColors{.chromaticities = has_colors ? *chosen.chromaticities : Chromaticities()};
}

}  // namespace baton
