#include "worker/run/crash_handler.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <string>

namespace baton {
namespace {

TEST(CrashHandlerDeathTest, PrintsTheLivingNotesAndDiesOfTheSignal) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  const auto crash = [] {
    install_crash_handler();
    const CrashNote first("replay --tile 1");
    { const CrashNote ended("replay --tile 2"); }
    std::abort();
  };
  EXPECT_EXIT(crash(), testing::KilledBySignal(SIGABRT),
              "crashed while doing:\nreplay --tile 1\n$");
}

TEST(CrashHandlerDeathTest, CutsALongNote) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  const auto crash = [] {
    install_crash_handler();
    const CrashNote note(std::string(10000, 'x'));
    ::raise(SIGSEGV);
  };
  EXPECT_EXIT(crash(), testing::KilledBySignal(SIGSEGV), "doing:\nx{500}\n$");
}

}  // namespace
}  // namespace baton
