#include "common/base/log.h"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/sinks/rotating_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
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

std::unique_ptr<spdlog::formatter> formatter_of(std::string_view program) {
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<LegibleMessage>('*').set_pattern(
      fmt::format("%Y-%m-%dT%H:%M:%S.%e%z {} %l: %*", program));
  return formatter;
}

}  // namespace

void init_logging(std::string_view program, std::string_view level) {
  auto to_stderr = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  auto sinks = std::make_shared<spdlog::sinks::dist_sink_mt>();
  sinks->add_sink(to_stderr);
  auto logger = std::make_shared<spdlog::logger>(std::string(program), sinks);
  logger->set_formatter(formatter_of(program));
  const char* from_environment = std::getenv("BATON_LOG");
  const std::string chosen = !level.empty()
                                 ? std::string(level)
                                 : (from_environment != nullptr ? from_environment : "info");
  const spdlog::level::level_enum parsed = spdlog::level::from_str(chosen);
  const bool is_known = parsed != spdlog::level::off || chosen == "off";
  to_stderr->set_level(is_known ? parsed : spdlog::level::info);
  logger->set_level(to_stderr->level());
  spdlog::set_default_logger(logger);
}

Status log_to_file(const std::filesystem::path& file) {
  const std::shared_ptr<spdlog::logger> logger = spdlog::default_logger();
  const auto sinks =
      std::dynamic_pointer_cast<spdlog::sinks::dist_sink_mt>(logger->sinks().front());
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  std::filesystem::permissions(file.parent_path(), std::filesystem::perms::owner_all, error);
  try {
    auto to_file =
        std::make_shared<spdlog::sinks::rotating_file_sink_mt>(file.string(), kMaxLogFileBytes, 1);
    to_file->set_formatter(formatter_of(logger->name()));
    to_file->set_level(spdlog::level::debug);
    if (sinks) sinks->add_sink(std::move(to_file));
  } catch (const spdlog::spdlog_ex& failure) {
    return Error{ErrorKind::io, failure.what()};
  }
  logger->set_level(std::min(logger->level(), spdlog::level::debug));
  logger->flush_on(spdlog::level::debug);
  return {};
}

}  // namespace baton
