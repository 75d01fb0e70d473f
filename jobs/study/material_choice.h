#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "jobs/study/auto_choice.h"

namespace baton {

/// What a pilot saw of a candidate that draws its samples anew, material by material.
struct MaterialNumbers {
  AutoCandidate candidate;
  std::vector<double> square;  ///< (materials) share of squared error over squared mean radiance
  double cost_us = 0;          ///< counted_cost_us per pixel with a surface and frame
};

/// A material of the pilot's pictures.
struct SeenMaterial {
  std::string name;
  double share = 0;  ///< of the pixels with a surface, (0, 1]
};

/// A setting for each material, and what is expected of the whole picture.
struct MaterialChoice {
  std::vector<SamplingSpec> sampling;  ///< (materials)
  double error = 0, cost_us = 0;       ///< as PilotNumbers

  /// "gold bidirectional N=24 M=128 + ground environment N=8", without colon and comma.
  std::string name(std::span<const SeenMaterial> materials) const;
};

/// The N that are tried beside a job's own: half and twice as many, or those between which
/// choose_by_material interpolates when N is free.
std::vector<int> material_particles(const SamplingSpec& asked);

/// The best setting for each material by choose_sampling's rules, which judge the picture as a
/// whole: errors and costs of the materials add up. With N given, the mean number of rays is at
/// most N. Found pair by pair of materials, from `base` on, the best setting for all alike; a
/// material departs from it only where that gains 5 %. nullopt: none departs, or nothing is
/// feasible. pilot: families together, simplest first, with the N of material_particles.
std::optional<MaterialChoice> choose_by_material(const JobSpec& job,
                                                 std::span<const SeenMaterial> materials,
                                                 std::span<const MaterialNumbers> pilot,
                                                 const SamplingSpec& base, double lit_pixels);

}  // namespace baton
