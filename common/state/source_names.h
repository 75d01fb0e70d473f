#pragma once

#include <array>
#include <string_view>

#include "common/state/sample_state.h"

namespace baton {

/// By PixelSource, for people and JSON.
inline constexpr std::array<std::string_view, kNumPixelSources> kSourceNames{
    "background", "fresh", "carried", "restarted", "refreshed", "catcher"};
constexpr std::string_view source_name(PixelSource source) {
  return kSourceNames.at(static_cast<std::size_t>(source));
}

}  // namespace baton
