#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/job/job_spec.h"

namespace baton {

/// How sharp a surface reflects, as far as methods differ by it: `glossy` from Phong exponents of
/// about 20, `mirror` from 500 (GGX: of the same width).
enum class Gloss : std::uint8_t { diffuse, glossy, mirror };

/// One fact of the stability suite: from which light on a method that is set so no longer holds.
struct KnownLimit {
  std::string_view subject;    ///< row of jobs/lab/stability/expected.csv
  std::string_view test_case;  ///< the case that shows it
  std::string_view verdict;    ///< its verdict: degrades or fails
  Method method;
  bool never_refreshed = false;  ///< only with sampling.refreshEvery 0
  enum class Light : std::uint8_t { turns, jumps, any } light = Light::any;
  double from_deg = 0;  ///< turns: degrees a frame
  Gloss gloss = Gloss::diffuse;
  bool any_gloss = false;
};

/// All that is known, the worst of each situation last.
std::span<const KnownLimit> known_limits();

/// How far the map turns from one of the job's frames to the next at most, degrees in [0, 180].
double turn_deg_per_frame(const JobSpec& job);

/// What is known to go wrong with the job's method under its light, one line each, with the method
/// that holds. light_jumps: the light changes at once somewhere.
std::vector<std::string> limit_warnings(const JobSpec& job, bool light_jumps);

}  // namespace baton
