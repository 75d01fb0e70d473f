#include "common/advice/known_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "common/job/plan/sequence.h"

namespace baton {
namespace {

using Light = KnownLimit::Light;

/// jobs/lab/stability/expected.csv, the rows in which a method no longer holds for the first time;
/// `unit_job` compares them.
constexpr KnownLimit kLimits[] = {
    {"sequential", "turn-0.7-diffuse", "degrades", Method::sequential, false, Light::turns, 0.7,
     Gloss::diffuse},
    {"sequential", "turn-5-diffuse", "fails", Method::sequential, false, Light::turns, 5,
     Gloss::diffuse},
    {"sequential", "turn-1.5-phong50", "fails", Method::sequential, false, Light::turns, 1.5,
     Gloss::glossy},
    {"sequential", "turn-5-phong1000", "fails", Method::sequential, false, Light::turns, 5,
     Gloss::mirror},
    {"published P=5", "turn-0.1-diffuse", "degrades", Method::sequential, true, Light::turns, 0.1,
     Gloss::diffuse},
    {"published P=5", "turn-0.7-diffuse", "fails", Method::sequential, true, Light::turns, 0.7,
     Gloss::diffuse},
    {"published P=5", "turn-0.7-phong50", "fails", Method::sequential, true, Light::turns, 0.7,
     Gloss::glossy},
    {"published P=5", "turn-0.7-phong1000", "fails", Method::sequential, true, Light::turns, 0.7,
     Gloss::mirror},
    {"sequential", "cut", "fails", Method::sequential, false, Light::jumps, 0, Gloss::diffuse,
     true},
    {"restir", "turn-0.7-phong50", "degrades", Method::restir, false, Light::turns, 0.7,
     Gloss::glossy},
    {"restir", "turn-5-phong50", "fails", Method::restir, false, Light::turns, 5, Gloss::glossy},
    {"restir", "turn-0.1-phong1000", "fails", Method::restir, false, Light::turns, 0.1,
     Gloss::mirror},
    {"restir", "cut", "fails", Method::restir, false, Light::jumps, 0, Gloss::diffuse, true},
    {"environment", "turn-0.1-phong50", "fails", Method::environment, false, Light::any, 0,
     Gloss::glossy},
    {"environment", "turn-0.1-phong1000", "fails", Method::environment, false, Light::any, 0,
     Gloss::mirror},
    {"brdf", "static", "fails", Method::brdf, false, Light::any, 0, Gloss::diffuse},
    {"brdf", "turn-0.1-phong50", "fails", Method::brdf, false, Light::any, 0, Gloss::glossy},
};

Gloss gloss_of(const MaterialSpec& material) {
  double exponent = 0;
  switch (material.kind) {
    case MaterialKind::diffuse:
      break;
    case MaterialKind::phong:
      exponent = material.ks > 0 ? material.exponent : 0;
      break;
    case MaterialKind::metallic_roughness:
      exponent = 2 / std::pow(material.roughness, 4) - 2;
      break;
    case MaterialKind::measured:
      return Gloss::glossy;
  }
  return exponent >= 500 ? Gloss::mirror : exponent >= 20 ? Gloss::glossy : Gloss::diffuse;
}

std::set<Gloss> glosses_of(const SceneSpec& scene) {
  std::set<Gloss> glosses;
  for (const auto& [name, material] : scene.materials) glosses.insert(gloss_of(material));
  return glosses;
}

std::string_view gloss_word(const KnownLimit& limit) {
  constexpr std::array<std::string_view, 3> kWords{" on diffuse surfaces", " on glossy surfaces",
                                                   " on near mirrors"};
  return limit.any_gloss ? "" : kWords.at(static_cast<std::size_t>(limit.gloss));
}

std::string in_words(const KnownLimit& limit, double turn_deg) {
  const std::string_view method = traits(limit.method).name;
  const std::string what = fmt::format(
      "`{}`{} {}", method, limit.never_refreshed ? " with refreshEvery 0" : "", limit.verdict);
  const std::string known = fmt::format("{} (case {} of docs/lab/stability.md); `pool` does not",
                                        gloss_word(limit), limit.test_case);
  switch (limit.light) {
    case Light::turns:
      return fmt::format("the light turns {:.4g} degrees a frame: {} from {:.4g}{}", turn_deg, what,
                         limit.from_deg, known);
    case Light::jumps:
      return fmt::format("the light jumps: {} for some frames after it{}", what, known);
    case Light::any:
      return fmt::format("sampling.method: {} by its noise{}", what, known);
  }
  return {};
}

}  // namespace

std::span<const KnownLimit> known_limits() { return kLimits; }

double turn_deg_per_frame(const JobSpec& job) {
  double most = 0;
  for (std::size_t i = 1; i < job.frames.size(); ++i) {
    const double turn = std::fmod(std::abs(rotation_deg_at(job.environment, job.frames[i]) -
                                           rotation_deg_at(job.environment, job.frames[i - 1])),
                                  360.0);
    most = std::max(most, std::min(turn, 360 - turn));
  }
  return most;
}

std::vector<std::string> limit_warnings(const JobSpec& job, bool light_jumps) {
  const double turn = turn_deg_per_frame(job);
  const std::set<Gloss> glosses = glosses_of(job.scene);
  const bool never_refreshed = job.sampling.refresh_every == 0;

  // Take the worst of each situation: the last.
  std::vector<const KnownLimit*> found;
  for (const KnownLimit& limit : kLimits) {
    const bool lit_so = limit.light == Light::any ||
                        (limit.light == Light::turns && turn >= limit.from_deg) ||
                        (limit.light == Light::jumps && light_jumps);
    const bool applies = limit.method == job.sampling.method && lit_so &&
                         (limit.any_gloss || glosses.contains(limit.gloss)) &&
                         (never_refreshed || !limit.never_refreshed);
    if (!applies) continue;
    std::erase_if(found, [&](const KnownLimit* other) {
      return other->light == limit.light && other->gloss == limit.gloss;
    });
    found.push_back(&limit);
  }
  std::vector<std::string> warnings;
  for (const KnownLimit* limit : found) warnings.push_back(in_words(*limit, turn));
  return warnings;
}

}  // namespace baton
