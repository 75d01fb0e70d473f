#pragma once

#include <span>

#include "common/job/job_spec.h"

namespace baton {

/// One use of the first pass's populations: whose failed rays make the mask, whose free samples are
/// exchanged.
struct Fold {
  int mask_population = -1;   ///< -1: all
  int giver_population = -1;  ///< -1: all
  float energy_scale = 1;
};
/// The folds of a policy; the image is their sum when energies are those of all populations
/// together.
std::span<const Fold> folds_of(MaskPolicy policy);

}  // namespace baton
