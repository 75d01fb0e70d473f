#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace baton {

/// How channels are named in a file. In the program they have plain names, which are those of most
/// compositors: "R", "normal.X", "depth". blender: layer, pass and channel, "ViewLayer.Normal.X".
enum class ChannelNaming : std::uint8_t { plain, blender };

/// The layer of Blender that all passes are in.
inline constexpr std::string_view kBlenderLayer = "ViewLayer.";

/// A channel as a file stores it.
struct StoredChannel {
  std::string name;
  /// Blender's vector to the next frame points from there to here.
  bool is_negated = false;

  bool operator==(const StoredChannel&) const = default;
};
StoredChannel stored_channel(const std::string& plain, ChannelNaming naming);

/// A channel of a file, by its plain name.
struct PlainChannel {
  std::string name;      ///< plain
  StoredChannel stored;  ///< in the file
};
/// Those of a file, by their plain names in alphabetical order: of Blender's naming where all are
/// in its layer and none would be called like another, else plain.
std::vector<PlainChannel> plain_channels(const std::vector<std::string>& stored);

}  // namespace baton
