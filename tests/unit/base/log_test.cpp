#include "common/base/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <filesystem>
#include <memory>
#include <string>

#include "common/base/files.h"

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

// What is only for those who look into it later is in the file, and not on the terminal.
TEST(Log, AFileHasWhatTheTerminalHasNot) {
  const std::shared_ptr<spdlog::logger> before = spdlog::default_logger();
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("log-" + std::to_string(::getpid()));
  const std::filesystem::path file = folder / "logs/node7.log";
  testing::internal::CaptureStderr();
  init_logging("log-test", "warn");
  ASSERT_TRUE(log_to_file(file).ok());
  spdlog::debug("job 1f00a3c2: taken");
  spdlog::warn("two\nlines");
  EXPECT_THAT(testing::internal::GetCapturedStderr(), Not(HasSubstr("taken")));
  const std::string logged = read_text_file(file, 1 << 20).value();
  EXPECT_THAT(logged, HasSubstr(" log-test debug: job 1f00a3c2: taken\n"));
  EXPECT_THAT(logged, HasSubstr(" log-test warning: two\n  lines\n"));
  // Others may not look into it.
  EXPECT_EQ(std::filesystem::status(file.parent_path()).permissions(),
            std::filesystem::perms::owner_all);
  for (std::size_t size = 0; size < 2 * kMaxLogFileBytes; size += 1 << 16)
    spdlog::debug("{}", std::string(1 << 16, 'x'));
  EXPECT_LE(std::filesystem::file_size(file), kMaxLogFileBytes);
  EXPECT_TRUE(std::filesystem::exists(folder / "logs/node7.1.log"));

  // Where nothing can be written, that is said, and nothing else.
  EXPECT_FALSE(log_to_file(file / "log").ok());
  spdlog::set_default_logger(before);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace baton
