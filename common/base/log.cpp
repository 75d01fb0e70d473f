#include "common/base/log.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <string>

namespace baton {

void init_logging(std::string_view program, std::string_view level) {
  auto logger = spdlog::stderr_logger_mt(std::string(program));
  logger->set_pattern(fmt::format("%Y-%m-%dT%H:%M:%S.%e%z {} %l: %v", program));
  const char* from_environment = std::getenv("BATON_LOG");
  const std::string chosen = !level.empty()
                                 ? std::string(level)
                                 : (from_environment != nullptr ? from_environment : "info");
  const spdlog::level::level_enum parsed = spdlog::level::from_str(chosen);
  logger->set_level(parsed == spdlog::level::off && chosen != "off" ? spdlog::level::info : parsed);
  spdlog::set_default_logger(logger);
}

}  // namespace baton
