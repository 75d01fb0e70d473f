#include "common/image/channel_names.h"

#include <algorithm>
#include <set>

namespace baton {
namespace {

struct Pair {
  std::string_view plain, pass;
  bool is_negated = false;
};
/// The passes that Blender has, too. Its depth is along the view, as Z is.
constexpr Pair kPasses[] = {
    {"R", "Combined.R"},
    {"G", "Combined.G"},
    {"B", "Combined.B"},
    {"A", "Combined.A"},
    {"Z", "Depth.Z"},
    {"depth", "Distance.X"},
    {"normal.X", "Normal.X"},
    {"normal.Y", "Normal.Y"},
    {"normal.Z", "Normal.Z"},
    {"P.X", "Position.X"},
    {"P.Y", "Position.Y"},
    {"P.Z", "Position.Z"},
    {"albedo.R", "DiffCol.R"},
    {"albedo.G", "DiffCol.G"},
    {"albedo.B", "DiffCol.B"},
    {"object", "IndexOB.X"},
    {"material", "IndexMA.X"},
    {"backward.u", "Vector.X"},
    {"backward.v", "Vector.Y"},
    {"forward.u", "Vector.Z", true},
    {"forward.v", "Vector.W", true},
};
/// Suffix of a pass with one channel.
constexpr std::string_view kOnly = ".X";

/// A name of the file without the layer.
PlainChannel plain_channel(const std::string& stored) {
  const std::string pass = stored.substr(kBlenderLayer.size());
  const auto found = std::ranges::find(kPasses, pass, &Pair::pass);
  if (found != std::end(kPasses)) return {std::string(found->plain), {stored, found->is_negated}};
  return {pass.ends_with(kOnly) ? pass.substr(0, pass.size() - kOnly.size()) : pass, {stored}};
}

}  // namespace

StoredChannel stored_channel(const std::string& plain, ChannelNaming naming) {
  if (naming == ChannelNaming::plain) return {plain};
  const auto found = std::ranges::find(kPasses, plain, &Pair::plain);
  const std::string layer(kBlenderLayer);
  if (found != std::end(kPasses)) return {layer + std::string(found->pass), found->is_negated};
  const bool is_only = plain.find('.') == plain.npos;
  return {layer + plain + std::string(is_only ? kOnly : "")};
}

std::vector<PlainChannel> plain_channels(const std::vector<std::string>& stored) {
  const bool of_blender = std::ranges::all_of(
      stored, [](const std::string& name) { return name.starts_with(kBlenderLayer); });
  std::vector<PlainChannel> channels;
  std::set<std::string> names;
  bool all_clear = true;
  for (const std::string& name : stored) {
    channels.push_back(of_blender ? plain_channel(name) : PlainChannel{name, {name}});
    const std::string& plain = channels.back().name;
    all_clear = all_clear && names.insert(plain).second && !plain.empty() &&
                !(of_blender && plain.starts_with(kBlenderLayer));
  }
  if (!all_clear) {
    for (PlainChannel& channel : channels) channel = {channel.stored.name, {channel.stored.name}};
  }
  std::ranges::sort(channels, {}, &PlainChannel::name);
  return channels;
}

}  // namespace baton
