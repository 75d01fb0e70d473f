#include "worker/sampling/folds.h"

#include <array>

namespace baton {
namespace {

constexpr std::array<Fold, 1> kSameSamples{Fold{}};
constexpr std::array<Fold, 1> kSplit{Fold{0, 1, 2.0f}};
constexpr std::array<Fold, 2> kCrossFold{Fold{0, 1, 1.0f}, Fold{1, 0, 1.0f}};

}  // namespace

std::span<const Fold> folds_of(MaskPolicy policy) {
  switch (policy) {
    case MaskPolicy::same_samples:
      return kSameSamples;
    case MaskPolicy::split:
      return kSplit;
    case MaskPolicy::cross_fold:
      return kCrossFold;
  }
  return {};
}

}  // namespace baton
