#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/job/farm_event.h"

namespace baton {

nlohmann::ordered_json event_json(const FarmEvent& event);
/// "2026-11-28 13:20:46Z  task done  job 1f00a3c2  frames 9-12, tile 3  node3  after 4.1 s".
std::string event_line(const FarmEvent& event);

}  // namespace baton
