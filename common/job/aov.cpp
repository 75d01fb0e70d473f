#include "common/job/aov.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

namespace baton {
namespace {

constexpr std::size_t kNumAovs = static_cast<std::size_t>(Aov::blocked) + 1;

/// "CryptoObject00.R", ".G", ".B", ".A", "CryptoObject01.R", ...
std::vector<std::string> crypto_channels(const char* layer) {
  std::vector<std::string> channels;
  for (std::size_t i = 0; i < 2 * kCryptoRanks; ++i)
    channels.push_back(fmt::format("{}{:02}.{}", layer, i / 4, "RGBA"[i % 4]));
  return channels;
}

AovTraits make_traits(Aov aov) {
  const auto geometry = [](std::vector<std::string> channels, double bytes) {
    return AovTraits{std::move(channels), true, true, bytes};
  };
  switch (aov) {
    case Aov::lns:
      return {.channels = {"lns"}, .is_float = true, .film_bytes = 3.2};
    case Aov::visibility:
      return {.channels = {"visibility"}, .film_bytes = 2.9};
    case Aov::ess:
      return {.channels = {"ess"}, .film_bytes = 1.6};
    case Aov::acceptance:
      return {.channels = {"acceptance"}, .film_bytes = 1.6};
    case Aov::source:
      return {.channels = {"source.R", "source.G", "source.B"}, .film_bytes = 0.1};
    case Aov::normal:
      return {.channels = {"normal.X", "normal.Y", "normal.Z"}, .is_float = true};
    case Aov::depth:
      return {.channels = {"depth"}, .is_float = true, .film_bytes = 2.9};
    case Aov::variance:
      return {.channels = {"variance.R", "variance.G", "variance.B"},
              .is_float = true,
              .film_bytes = 12};
    case Aov::mask:
      return {.channels = {"mask"}, .film_bytes = 0.1};
    case Aov::acceptance_local:
      return {.channels = {"acceptanceLocal"}, .film_bytes = 1.6};
    case Aov::acceptance_independent:
      return {.channels = {"acceptanceIndependent"}, .film_bytes = 1.6};
    case Aov::resampled:
      return {.channels = {"resampled"}, .film_bytes = 0.1};
    case Aov::rounds:
      return {.channels = {"rounds"}, .is_float = true, .film_bytes = 0.1};
    case Aov::material:
      return {.channels = {"material"}, .is_float = true, .film_bytes = 0.1};
    case Aov::albedo: {
      AovTraits row = geometry({"albedo.R", "albedo.G", "albedo.B"}, 1);
      row.is_float = false;
      return row;
    }
    case Aov::position:
      return geometry({"P.X", "P.Y", "P.Z"}, 7);
    case Aov::z:
      return geometry({"Z"}, 2.5);
    case Aov::motion:
      return geometry({"forward.u", "forward.v", "backward.u", "backward.v"}, 12);
    case Aov::object:
      return geometry({"object"}, 0.1);
    case Aov::crypto_object:
      return geometry(crypto_channels(kCryptoObject), 1);
    case Aov::crypto_material:
      return geometry(crypto_channels(kCryptoMaterial), 1);
    case Aov::unshadowed:
      return {.channels = {"unshadowed.R", "unshadowed.G", "unshadowed.B"},
              .is_float = true,
              .film_bytes = 9.3};
    case Aov::blocked:
      return {.channels = {"blocked.R", "blocked.G", "blocked.B"},
              .is_float = true,
              .film_bytes = 10.7};
  }
  return {};
}

}  // namespace

const AovTraits& traits(Aov aov) {
  static const std::array<AovTraits, kNumAovs> kTable = [] {
    std::array<AovTraits, kNumAovs> table;
    for (std::size_t i = 0; i < kNumAovs; ++i) table.at(i) = make_traits(static_cast<Aov>(i));
    return table;
  }();
  return kTable.at(static_cast<std::size_t>(aov));
}

bool has_aov(const JobSpec& job, Aov aov) {
  return std::ranges::find(job.output.aovs, aov) != job.output.aovs.end();
}

std::vector<std::string> object_names(const JobSpec& job) {
  std::vector<std::string> names;
  std::map<std::string, int> counts;
  for (const ObjectSpec& object : job.scene.objects) {
    const int count = ++counts[object.mesh];
    names.push_back(count == 1 ? object.mesh : fmt::format("{}.{}", object.mesh, count));
  }
  if (job.scene.ground) names.emplace_back("ground");
  return names;
}

std::vector<std::string> material_names(const JobSpec& job) {
  std::vector<std::string> names;
  for (const auto& [name, material] : job.scene.materials) names.push_back(name);
  return names;
}

}  // namespace baton
