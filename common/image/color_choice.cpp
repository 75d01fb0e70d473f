#include "common/image/color_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <tuple>

namespace baton {
namespace {

/// "diffuse." of "diffuse.R".
std::string layer_of(const std::string& name) { return name.substr(0, name.rfind('.') + 1); }

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

/// A layer of a part, by what its channels are called.
struct Layer {
  std::size_t part = 0;
  std::string name{};  ///< with its dot, or empty
  std::array<std::string, 3> rgb{};
  std::string x{}, y{}, ry{}, by{}, alpha{};

  std::size_t num_colors() const {
    return 3 - static_cast<std::size_t>(std::ranges::count(rgb, std::string()));
  }
  /// Y beside X is a coordinate.
  bool has_luminance() const { return !y.empty() && x.empty(); }
  bool is_luma_chroma() const { return has_luminance() && !ry.empty() && !by.empty(); }
  bool has_colors() const { return num_colors() > 0 || has_luminance(); }
};

void take(const std::string& channel, Layer& layer) {
  const std::string last = lower(channel.substr(layer.name.size()));
  if (last == "r" || last == "red") layer.rgb[0] = channel;
  if (last == "g" || last == "green") layer.rgb[1] = channel;
  if (last == "b" || last == "blue") layer.rgb[2] = channel;
  if (last == "a" || last == "alpha") layer.alpha = channel;
  if (last == "x") layer.x = channel;
  if (last == "y") layer.y = channel;
  if (last == "ry") layer.ry = channel;
  if (last == "by") layer.by = channel;
}

/// All layers with colours, in the order of the file.
std::vector<Layer> layers_of(const std::vector<PartLayout>& parts) {
  std::vector<Layer> layers;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    for (const std::string& channel : parts[part].channels) {
      const std::string name = layer_of(channel);
      auto found = std::ranges::find_if(
          layers, [&](const Layer& l) { return l.part == part && l.name == name; });
      if (found == layers.end()) {
        layers.push_back({.part = part, .name = name});
        found = layers.end() - 1;
      }
      take(channel, *found);
    }
  }
  std::erase_if(layers, [](const Layer& l) { return !l.has_colors(); });
  return layers;
}

/// The less the better.
auto rank(const Layer& layer) {
  const std::string name = lower(layer.name);
  const auto is_called = [&](const char* word) { return name.find(word) != name.npos; };
  const bool is_beauty = is_called("beauty") || is_called("combined") || is_called("rgb");
  return std::tuple(layer.num_colors() < 3 && !layer.is_luma_chroma(), !name.empty(), !is_beauty);
}

std::string title(const Layer& layer, const std::vector<PartLayout>& parts) {
  const std::string name = layer.name.empty() ? "" : layer.name.substr(0, layer.name.size() - 1);
  if (parts.size() == 1) return name.empty() ? "R, G, B" : fmt::format("layer \"{}\"", name);
  const std::string& part = parts[layer.part].name;
  return fmt::format("part {}{}{}", layer.part + 1,
                     part.empty() ? "" : fmt::format(" \"{}\"", part),
                     name.empty() ? "" : fmt::format(", layer \"{}\"", name));
}

/// Layers beside the plain one of the same part are passes of it: that is no choice.
bool is_choice(const Layer& chosen, const std::vector<Layer>& layers) {
  return std::ranges::any_of(layers, [&](const Layer& other) {
    const bool is_same = other.part == chosen.part && other.name == chosen.name;
    return !is_same && !(chosen.name.empty() && other.part == chosen.part);
  });
}

}  // namespace

std::optional<ColorChoice> choose_colors(const std::vector<PartLayout>& parts) {
  const std::vector<Layer> layers = layers_of(parts);
  if (layers.empty()) {
    const bool has_one = parts.size() == 1 && parts[0].channels.size() == 1;
    return has_one ? std::optional(any_channels(parts)) : std::nullopt;
  }
  const Layer& layer = *std::ranges::min_element(
      layers, [](const Layer& a, const Layer& b) { return rank(a) < rank(b); });
  ColorChoice choice{.part = layer.part, .colors = {}, .alpha = layer.alpha, .notes = {}};
  if (layer.num_colors() == 0) {
    choice.is_luma_chroma = layer.is_luma_chroma();
    choice.colors = {layer.y};
    if (choice.is_luma_chroma) choice.colors = {layer.y, layer.ry, layer.by};
  } else {
    choice.colors.assign(layer.rgb.begin(), layer.rgb.end());
    while (choice.colors.back().empty()) choice.colors.pop_back();
  }
  if (is_choice(layer, layers))
    choice.notes.push_back(fmt::format("has {} pictures: the colours of {} are read", layers.size(),
                                       title(layer, parts)));
  if (choice.colors.size() > 1 && !choice.is_luma_chroma && layer.num_colors() < 3)
    choice.notes.push_back("lacks some of R, G and B: they count as 0");
  return choice;
}

ColorChoice any_channels(const std::vector<PartLayout>& parts) {
  std::vector<std::string> all = parts.at(0).channels;
  const auto alpha = std::ranges::find_if(all, [&](const std::string& channel) {
    const std::string name = lower(channel);
    return all.size() > 1 && (name == "a" || name == "alpha");
  });
  ColorChoice choice;
  if (alpha != all.end()) {
    choice.alpha = *alpha;
    all.erase(alpha);
  }
  all.resize(all.size() < 3 ? 1 : 3);
  choice.colors = all;
  const std::string name = lower(all[0]);
  if (name != "a" && name != "alpha")
    choice.notes.push_back(fmt::format("has no colours by name: {} {} read", fmt::join(all, ", "),
                                       all.size() == 1 ? "is" : "are"));
  return choice;
}

}  // namespace baton
