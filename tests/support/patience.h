#pragma once

#include <cstdlib>

namespace baton {

/// `time` times BATON_TEST_PATIENCE (a positive integer; 1 when unset), which builds with
/// sanitizers set: for what must come in time.
template <class Duration>
Duration with_patience(Duration time) {
  const char* factor = std::getenv("BATON_TEST_PATIENCE");
  return factor == nullptr ? time : time * std::atoi(factor);
}

}  // namespace baton
