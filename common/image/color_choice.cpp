#include "common/image/color_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <tuple>

namespace baton {
namespace {

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return text;
}

/// Names of red, green, blue and alpha.
constexpr std::array<std::array<std::string_view, 2>, 4> kColorNames{
    {{"r", "red"}, {"g", "green"}, {"b", "blue"}, {"a", "alpha"}}};

/// Index into kColorNames of a name in lower case; their number: none of them.
std::size_t color_index(std::string_view name) {
  const auto* const found = std::ranges::find_if(kColorNames, [&](const auto& names) {
    return std::ranges::find(names, name) != names.end();
  });
  return static_cast<std::size_t>(found - kColorNames.begin());
}

/// "diffuse." of "diffuse.R"; of a name without a dot "diffuse_" of "diffuse_R", or "diffuse" of
/// "diffuseR", where what follows is a colour.
std::string layer_of(const std::string& name) {
  if (const std::size_t dot = name.rfind('.'); dot != name.npos) return name.substr(0, dot + 1);
  if (const std::size_t mark = name.find_last_of("_-:/ "); mark != name.npos)
    return color_index(lower(name.substr(mark + 1))) < kColorNames.size() ? name.substr(0, mark + 1)
                                                                          : std::string();
  const std::size_t last = name.find_last_of("ABGR");
  const char before = last != name.npos && last > 0 ? name[last - 1] : 'A';
  const bool begins_word = !(before >= 'A' && before <= 'Z');
  return begins_word && color_index(lower(name.substr(last))) < kColorNames.size()
             ? name.substr(0, last)
             : std::string();
}

/// A layer of a part, by what its channels are called.
struct Layer {
  std::size_t part = 0;
  /// With what divides it from the channel's, or empty.
  std::string name{};
  std::array<std::string, 3> rgb{};
  std::string x{}, y{}, ry{}, by{}, alpha{};

  std::size_t num_colors() const {
    return 3 - static_cast<std::size_t>(std::ranges::count(rgb, std::string()));
  }
  /// Y beside X is a coordinate.
  bool has_luminance() const { return !y.empty() && x.empty(); }
  bool is_luma_chroma() const { return has_luminance() && !ry.empty() && !by.empty(); }
  /// One without a dot has all three: by chance a name ends as that of a colour does.
  bool has_colors() const {
    if (!name.empty() && !name.ends_with('.')) return num_colors() == 3;
    return num_colors() > 0 || has_luminance();
  }
  /// Its name as people say it.
  std::string title() const {
    const bool is_marked =
        !name.empty() && std::string_view("._-:/ ").find(name.back()) != name.npos;
    return is_marked ? name.substr(0, name.size() - 1) : name;
  }
};

void take(const std::string& channel, Layer& layer) {
  const std::string last = lower(channel.substr(layer.name.size()));
  const std::size_t color = color_index(last);
  if (color < 3) layer.rgb.at(color) = channel;
  if (color == 3) layer.alpha = channel;
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

/// 0: the name of a whole picture; 1: has one in it; 2: another.
int beauty_rank(const std::string& given) {
  const std::string name = lower(given);
  int best = 2;
  for (const std::string_view word : {"beauty", "combined", "rgb", "rgba"}) {
    if (name == word) return 0;
    if (name.find(word) != name.npos) best = 1;
  }
  return best;
}

/// The less the better.
auto rank(const Layer& layer, const std::vector<PartLayout>& parts) {
  return std::tuple(layer.num_colors() < 3 && !layer.is_luma_chroma(),
                    beauty_rank(parts[layer.part].name), !layer.name.empty(),
                    beauty_rank(layer.title()));
}

std::string title(const Layer& layer, const std::vector<PartLayout>& parts) {
  const std::string name = layer.title();
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
      layers, [&](const Layer& a, const Layer& b) { return rank(a, parts) < rank(b, parts); });
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
