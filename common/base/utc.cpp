#include "common/base/utc.h"

#include <chrono>

namespace baton {

std::int64_t now_ms() {
  using namespace std::chrono;
  return duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
}

}  // namespace baton
