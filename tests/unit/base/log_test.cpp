#include "common/base/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <memory>

namespace baton {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

// Names and errors of others are in them.
TEST(Log, NoPartOfAMessageLooksLikeALine) {
  const std::shared_ptr<spdlog::logger> before = spdlog::default_logger();
  testing::internal::CaptureStderr();
  init_logging("log-test", "info");
  spdlog::warn("a name\n2026-01-01T00:00:00 forged\x1b[2J\u202e");
  spdlog::default_logger()->flush();
  const std::string said = testing::internal::GetCapturedStderr();
  spdlog::set_default_logger(before);
  EXPECT_THAT(said, ContainsRegex("^20[0-9][0-9]-[0-9-]+T[0-9:.]+[+-][0-9:]+ log-test warning: a"));
  EXPECT_THAT(said, HasSubstr("a name\n  2026-01-01T00:00:00 forged\\x1b[2J\\u202e\n"));
  EXPECT_THAT(said, Not(HasSubstr("\x1b")));
}

}  // namespace
}  // namespace baton
