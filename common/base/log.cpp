#include "common/base/log.h"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <utility>

#include "common/base/legible.h"

namespace baton {
namespace {

/// A message as it may stand in a log, whatever names and errors are in it: no line of it looks
/// like one of its own.
class LegibleMessage : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& line) override {
    for (const char c : legible_text({message.payload.data(), message.payload.size()})) {
      line.push_back(c);
      if (c == '\n') line.append(kIndent.data(), kIndent.data() + kIndent.size());
    }
  }
  std::unique_ptr<custom_flag_formatter> clone() const override {
    return spdlog::details::make_unique<LegibleMessage>();
  }

 private:
  static constexpr std::string_view kIndent = "  ";
};

}  // namespace

void init_logging(std::string_view program, std::string_view level) {
  auto logger = spdlog::stderr_logger_mt(std::string(program));
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<LegibleMessage>('*').set_pattern(
      fmt::format("%Y-%m-%dT%H:%M:%S.%e%z {} %l: %*", program));
  logger->set_formatter(std::move(formatter));
  const char* from_environment = std::getenv("BATON_LOG");
  const std::string chosen = !level.empty()
                                 ? std::string(level)
                                 : (from_environment != nullptr ? from_environment : "info");
  const spdlog::level::level_enum parsed = spdlog::level::from_str(chosen);
  logger->set_level(parsed == spdlog::level::off && chosen != "off" ? spdlog::level::info : parsed);
  spdlog::set_default_logger(logger);
}

}  // namespace baton
