#pragma once

#include "common/base/patience.h"

namespace baton {

/// `time` times the build's patience: for what must come in time.
template <class Duration>
constexpr Duration with_patience(Duration time) {
  return time * kPatienceFactor;
}

}  // namespace baton
