#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "common/job/job_json.h"

namespace baton {
namespace {

/// Beginnings of the paths that do not decide pixels.
constexpr std::array<std::string_view, 12> kSettings{"/name",
                                                     "/priority",
                                                     "/metadata",
                                                     "/frames",
                                                     "/image/tileSize",
                                                     "/output",
                                                     "/state/",
                                                     "/maxRetriesPerTask",
                                                     "/maxFailedTasks",
                                                     "/maxFailuresPerWorker",
                                                     "/maxSecondsPerTask",
                                                     "/specificationVersion"};
/// Of these, those that do: what a pixel knows of earlier frames decides where its rays go.
constexpr std::array<std::string_view, 2> kOfThePicture{"/state/carry", "/state/preroll"};

bool is_setting(std::string_view path) {
  if (std::ranges::find(kOfThePicture, path) != kOfThePicture.end()) return false;
  return std::any_of(kSettings.begin(), kSettings.end(),
                     [&](std::string_view start) { return path.starts_with(start); });
}

/// "/image/sites" as "$.image.sites", "/objects/3/mesh" as "$.objects[3].mesh".
std::string json_path(std::string_view pointer) {
  std::string path = "$";
  while (!pointer.empty()) {
    const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
    const std::string_view key = pointer.substr(1, end - 1);
    const bool is_index = !key.empty() && key.find_first_not_of("0123456789") == key.npos;
    path += is_index ? "[" + std::string(key) + "]" : "." + std::string(key);
    pointer.remove_prefix(end);
  }
  return path;
}

}  // namespace

std::vector<std::string> picture_differences(const ParsedJobDocument& a,
                                             const ParsedJobDocument& b) {
  std::set<std::string> differences;

  // Leaf by leaf; what only one has is there, too.
  const nlohmann::json left = nlohmann::json::parse(to_json(a.job)).flatten();
  const nlohmann::json right = nlohmann::json::parse(to_json(b.job)).flatten();
  const auto compare = [&](const nlohmann::json& one, const nlohmann::json& other) {
    for (const auto& [path, value] : one.items()) {
      if (is_setting(path)) continue;
      const auto found = other.find(path);
      if (found == other.end() || *found != value) differences.insert(json_path(path));
    }
  };
  compare(left, right);
  compare(right, left);

  // The same file with another content.
  std::map<std::string, Digest> before;
  for (const AssetDigest& asset : a.assets) before[asset.path] = asset.digest;
  for (const AssetDigest& asset : b.assets) {
    const auto found = before.find(asset.path);
    if (found != before.end() && found->second != asset.digest) differences.insert(asset.path);
  }
  return {differences.begin(), differences.end()};
}

}  // namespace baton
