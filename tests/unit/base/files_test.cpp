#include "common/base/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <iterator>

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// An empty folder for one test.
class FilesTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / "baton_files" / info->name();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  auto num_files() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator{});
  }

  fs::path folder_;
};

TEST_F(FilesTest, WritesWholeFilesAndLeavesNothingElse) {
  const fs::path file = folder_ / "a.txt";
  ASSERT_TRUE(write_file_atomic(file, as_bytes_view("first")).ok());
  ASSERT_TRUE(write_file_atomic(file, as_bytes_view("second")).ok());
  EXPECT_EQ(*read_text_file(file, 100), "second");
  EXPECT_EQ(num_files(), 1);
}

TEST_F(FilesTest, CreatesMissingFolders) {
  const fs::path file = folder_ / "b" / "c" / "d.txt";
  ASSERT_TRUE(write_file_atomic(file, as_bytes_view("deep")).ok());
  EXPECT_EQ(*read_text_file(file, 100), "deep");
}

TEST_F(FilesTest, AFailedPublicationNamesThePathAndLeavesNothing) {
  const fs::path occupied = folder_ / "a";
  fs::create_directories(occupied / "inside");
  const Status status = write_file_atomic(occupied, as_bytes_view("x"));
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, ErrorKind::io);
  EXPECT_THAT(status.error().message, HasSubstr(occupied.string()));
  EXPECT_EQ(num_files(), 1);
}

TEST_F(FilesTest, ReadsNothingPastTheLimit) {
  const fs::path file = folder_ / "a.txt";
  ASSERT_TRUE(write_file_atomic(file, as_bytes_view("12345")).ok());
  EXPECT_TRUE(read_file(file, 5).ok());
  const auto bytes = read_file(file, 4);
  ASSERT_FALSE(bytes.ok());
  EXPECT_EQ(bytes.error().message, file.string() + ": 5 bytes, at most 4 are read");
}

TEST_F(FilesTest, MissingFilesFoldersAndPipesAreErrors) {
  EXPECT_EQ(read_file(folder_ / "none", 10).error().kind, ErrorKind::io);
  EXPECT_THAT(read_file(folder_, 10).error().message, HasSubstr("is a folder, expected a file"));
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_FALSE(read_file(pipe, 10).ok());
}

TEST_F(FilesTest, TemporarySiblingsDifferAndShareTheFolder) {
  const fs::path a = temporary_sibling(folder_ / "a.txt");
  const fs::path b = temporary_sibling(folder_ / "a.txt");
  EXPECT_NE(a, b);
  EXPECT_EQ(a.parent_path(), folder_);
  EXPECT_EQ(temporary_sibling("a.txt").parent_path(), fs::path());
}

}  // namespace
}  // namespace baton
