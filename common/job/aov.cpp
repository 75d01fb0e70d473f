#include "common/job/aov.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "common/job/job_facts.h"

namespace baton {
namespace {

/// "CryptoObject00.R", ".G", ".B", ".A", "CryptoObject01.R", ...
std::vector<std::string> crypto_channels(const char* layer) {
  std::vector<std::string> channels;
  for (std::size_t i = 0; i < 2 * kCryptoRanks; ++i)
    channels.push_back(fmt::format("{}{:02}.{}", layer, i / 4, "RGBA"[i % 4]));
  return channels;
}

/// In the order of the enumeration.
const std::vector<AovTraits>& table() {
  const auto rgb = [](const std::string& layer) {
    return std::vector<std::string>{layer + ".R", layer + ".G", layer + ".B"};
  };
  // clang-format off
  static const std::vector<AovTraits> kTable{
      // name                   channels                               is_float  of_geometry  film_bytes
      {"lns",                   {"lns"},                               true,     false,       3.2},
      {"visibility",            {"visibility"},                        false,    false,       2.9},
      {"ess",                   {"ess"},                               false,    false,       1.6},
      {"acceptance",            {"acceptance"},                        false,    false,       1.6},
      {"source",                rgb("source"),                         false,    false,       0.1},
      {"normal",                {"normal.X", "normal.Y", "normal.Z"},  true,     false,       4},
      {"depth",                 {"depth"},                             true,     false,       2.9},
      {"variance",              rgb("variance"),                       true,     false,       12},
      {"mask",                  {"mask"},                              false,    false,       0.1},
      {"acceptanceLocal",       {"acceptanceLocal"},                   false,    false,       1.6},
      {"acceptanceIndependent", {"acceptanceIndependent"},             false,    false,       1.6},
      {"resampled",             {"resampled"},                         false,    false,       0.1},
      {"rounds",                {"rounds"},                            true,     false,       0.1},
      {"material",              {"material"},                          true,     false,       0.1},
      {"albedo",                rgb("albedo"),                         false,    true,        1},
      {"position",              {"P.X", "P.Y", "P.Z"},                 true,     true,        7},
      {"z",                     {"Z"},                                 true,     true,        2.5},
      {"motion", {"forward.u", "forward.v", "backward.u", "backward.v"}, true,   true,        12},
      {"object",                {"object"},                            true,     true,        0.1},
      {"cryptoObject",          crypto_channels(kCryptoObject),        true,     true,        1},
      {"cryptoMaterial",        crypto_channels(kCryptoMaterial),      true,     true,        1},
      {"unshadowed",            rgb("unshadowed"),                     true,     false,       9.3},
      {"blocked",               rgb("blocked"),                        true,     false,       10.7},
      {"direct",                rgb("direct"),                         true,     false,       9.3},
      {"indirect",              rgb("indirect"),                       true,     false,       9.5},
  };
  // clang-format on
  return kTable;
}

}  // namespace

const AovTraits& traits(Aov aov) { return table().at(static_cast<std::size_t>(aov)); }

std::vector<std::string_view> aov_names() {
  std::vector<std::string_view> names;
  for (const AovTraits& row : table()) names.push_back(row.name);
  return names;
}

bool has_aov(const JobSpec& job, Aov aov) {
  return std::ranges::find(job.output.aovs, aov) != job.output.aovs.end();
}

std::string_view why_empty(Aov aov, const JobSpec& job) {
  const Method method = job.sampling.method;
  switch (aov) {
    case Aov::acceptance:
    case Aov::acceptance_local:
    case Aov::acceptance_independent:
    case Aov::resampled:
      return traits(method).moves_samples ? "" : "only `sequential` fills it";
    case Aov::variance:
      return tells_noise(job) ? ""
                              : "samples that are carried, or that a second pass exchanges, tell "
                                "nothing of their error";
    case Aov::indirect:
      return job.light.bounces > 0 ? "" : "light.bounces is 0";
    case Aov::ess:
      return traits(method).keeps_samples ? "" : "the method's rays have no weights";
    default:
      return "";
  }
}

std::vector<std::string> object_names(const JobSpec& job) {
  std::vector<ObjectSpec> objects = job.scene.objects;
  if (job.scene.ground) objects.push_back({.mesh = "ground", .material = {}});
  std::set<std::string> named, meshes;
  for (const ObjectSpec& object : objects)
    (object.name.empty() ? meshes : named).insert(object.name.empty() ? object.mesh : object.name);

  std::vector<std::string> names;
  std::map<std::string, int> counts;
  for (const ObjectSpec& object : objects) {
    std::string name = object.name;
    while (name.empty()) {
      const int count = ++counts[object.mesh];
      name = count == 1 ? object.mesh : fmt::format("{}.{}", object.mesh, count);
      if (named.contains(name) || (count > 1 && meshes.contains(name))) name.clear();
    }
    names.push_back(name);
  }
  return names;
}

bool mattes_alike(const JobSpec& a, const JobSpec& b) {
  return !has_aov(a, Aov::crypto_object) || !has_aov(b, Aov::crypto_object) ||
         object_names(a) == object_names(b);
}

std::vector<std::string> material_names(const JobSpec& job) {
  std::vector<std::string> names;
  for (const auto& [name, material] : job.scene.materials) names.push_back(name);
  return names;
}

}  // namespace baton
