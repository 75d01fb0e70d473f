#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace baton {

/// A part of an EXR file: a picture of its own, with a name where there are several.
struct PartLayout {
  std::string name;
  std::vector<std::string> channels;
};

/// Which channels of a file are its colours; names as in the file.
struct ColorChoice {
  std::size_t part = 0;
  /// Red, green and blue, empty where there is none, or one of grey.
  std::vector<std::string> colors{};
  std::string alpha{};          ///< empty: none
  bool is_luma_chroma = false;  ///< colors are Y, RY, BY
  /// What was chosen where there was a choice, and what is missing, a line each.
  std::vector<std::string> notes{};
};

/// The rule for all readers. A layer is the channels of a part with one prefix ("diffuse." of
/// "diffuse.R"). It has colours if it has some of R, G, B, or Red, Green, Blue, in either case, or
/// luminance Y, with RY and BY or alone; its alpha is A or Alpha. Without a dot all three colours
/// of "diffuse_R" or "diffuseR" are a layer, too. Of several layers those with three colours come
/// first, among them those of a part called beauty, combined, rgb or rgba, then of one with such a
/// word in its name; in a part the layer without a name, then by the same words, then the first in
/// the file. Layers beside the plain one of their part are passes, of which nothing is noted. Where
/// none has colours: the only channel, as grey; nullopt: there are several.
std::optional<ColorChoice> choose_colors(const std::vector<PartLayout>& parts);

/// Where no layer has colours: the first three channels of the first part, or the first as grey.
ColorChoice any_channels(const std::vector<PartLayout>& parts);

}  // namespace baton
