#include "coordinator/service/file_room.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <optional>

namespace baton {
namespace {

/// The limit of open files of this process, until its end.
struct FileLimit {
  explicit FileLimit(rlim_t most) {
    ::getrlimit(RLIMIT_NOFILE, &before);
    const rlimit less{most, before.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_NOFILE, &less), 0);
  }
  ~FileLimit() { ::setrlimit(RLIMIT_NOFILE, &before); }
  FileLimit(const FileLimit&) = delete;
  FileLimit& operator=(const FileLimit&) = delete;

  rlimit before{};
};

TEST(FileRoom, LacksDescriptorsWhereFewOrNoneAreLeft) {
  EXPECT_EQ(lack_of_descriptors(), std::nullopt);
  for (const rlim_t most : {3u, 12u}) {
    std::optional<std::string> lack;
    {
      const FileLimit limit(most);
      lack = lack_of_descriptors();
    }
    EXPECT_THAT(lack.value_or("none"), testing::HasSubstr("file descriptors")) << most;
  }
}

// Where /proc is not mounted nobody can say.
TEST(FileRoom, AnyOtherErrorIsNoLack) {
  EXPECT_EQ(lack_of_descriptors("/proc/self/no-such-folder"), std::nullopt);
  EXPECT_EQ(lack_of_descriptors("/proc/self/stat"), std::nullopt);
}

}  // namespace
}  // namespace baton
