#include "common/store/folder_token.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "common/base/files.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(FolderToken, ATokenStaysAndTellsItsFolder) {
  const fs::path folder = fs::path(testing::TempDir()) / "folder_token";
  fs::remove_all(folder);
  const std::string token = make_token(folder / "shared" / "token").value();
  EXPECT_EQ(token.size(), 16u);
  EXPECT_EQ(make_token(folder / "shared" / "token").value(), token);
  EXPECT_NE(make_token(folder / "other" / "token").value(), token);
  EXPECT_TRUE(expect_token(folder / "shared" / "token", token));

  for (const char* where : {"other", "nowhere"}) {
    const Status seen = expect_token(folder / where / "token", token);
    ASSERT_FALSE(seen);
    EXPECT_THAT(seen.error().message, HasSubstr((folder / where).string() + ": not the folder"));
  }
}

// What cannot be read is no other folder; a folder in its place is none.
TEST(FolderToken, WhyItCannotBeReadIsSaid) {
  const fs::path folder = fs::path(testing::TempDir()) / "unreadable";
  fs::remove_all(folder);
  fs::create_directories(folder / "token");
  const fs::path file = folder / std::string(300, 'a');  // longer than names are
  const Status seen = expect_token(file, "abc");
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().kind, ErrorKind::io) << "of the moment: it is looked at again";
  EXPECT_THAT(seen.error().message, HasSubstr("File name too long"));
  EXPECT_FALSE(has_token(file, "abc"));
  EXPECT_FALSE(has_token(folder / "token", "abc").value());
}

// As of a file system that shows late what another machine has written.
TEST(FolderToken, OneThatComesLateIsWaitedFor) {
  const fs::path file = fs::path(testing::TempDir()) / "late" / "token";
  fs::remove_all(file.parent_path());
  std::thread writer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(write_token(file, "abc", "1"));
  });
  Patience patience;
  EXPECT_EQ(read_after_token(file, "abc", &patience).value(), "1");
  writer.join();
}

TEST(FolderToken, ALineMayStandAfterIt) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "line" / "token";
  ASSERT_TRUE(write_token(file, "abc", "2-5,9"));
  EXPECT_EQ(read_after_token(file, "abc").value(), "2-5,9");
  EXPECT_TRUE(expect_token(file, "abc"));
  EXPECT_FALSE(expect_token(file, "ab"));
  EXPECT_FALSE(expect_token(file, "abc\n"));
  ASSERT_TRUE(write_token(file, "abc"));
  EXPECT_EQ(read_after_token(file, "abc").value(), "");
}

}  // namespace
}  // namespace baton
