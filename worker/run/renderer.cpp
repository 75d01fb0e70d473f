#include "worker/run/renderer.h"

#include <fmt/format.h>

#include "worker/accel/accel.h"
#include "worker/pass/tile_renderer.h"

namespace baton {

const std::string& describe_renderer() {
  static const std::string description = [] {
    const auto accel = Accel::build(Scene());
    return fmt::format("{}, {}", instruction_set(),
                       accel ? (*accel)->description() : accel.error().message);
  }();
  return description;
}

}  // namespace baton
