#pragma once

#include <fmt/format.h>

#include <utility>

#include "common/base/legible.h"

namespace baton {

/// Lines for people, on standard output: what others have named is shown as legible_text has it.
template <class... Args>
void say(fmt::format_string<Args...> format, Args&&... args) {
  fmt::print("{}", legible_text(fmt::format(format, std::forward<Args>(args)...)));
}
/// Likewise on standard error: what is no result.
template <class... Args>
void tell(fmt::format_string<Args...> format, Args&&... args) {
  fmt::print(stderr, "{}", legible_text(fmt::format(format, std::forward<Args>(args)...)));
}

}  // namespace baton
