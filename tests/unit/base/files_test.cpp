#include "common/base/files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
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

TEST_F(FilesTest, AFolderThatCannotBeMadeIsNamedWithItsReason) {
  const fs::path folder = folder_ / std::string(300, 'x');
  const Status written = write_file_unsynced(folder / "file", as_bytes_view("1"));
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().message, folder.string() + ": cannot create: File name too long");
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

TEST_F(FilesTest, AVerifiedFileGetsItsNameOnlyAfterTheCheck) {
  const fs::path file = folder_ / "frame";
  fs::path seen;
  const Result<bool> written = write_file_verified(
      file, as_bytes_view("content"), [&](const fs::path& temporary) -> Result<bool> {
        seen = temporary;
        EXPECT_FALSE(fs::exists(file));
        BATON_TRY(expect_content(temporary, as_bytes_view("content")));
        return false;
      });
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_TRUE(*written);
  EXPECT_NE(seen, file);
  EXPECT_EQ(read_text_file(file, 100).value(), "content");

  const fs::path refused = folder_ / "refused";
  const auto refuse = [](const fs::path&) -> Result<bool> {
    return Error{ErrorKind::corrupt, "no"};
  };
  EXPECT_FALSE(write_file_verified(refused, as_bytes_view("x"), refuse));
  EXPECT_EQ(num_files(), 1);
}

// A link on the way may lead elsewhere since the path was looked at: the folder that is held
// counts.
TEST_F(FilesTest, NothingIsWrittenOutsideTheRoots) {
  const fs::path inside = folder_ / "in", outside = folder_ / "out", link = inside / "frames";
  fs::create_directories(inside / "real");
  fs::create_directories(outside);
  const Roots roots{folder_ / "none", inside};
  fs::create_directory_symlink(outside, link);
  const auto publish = [&](const fs::path& file) {
    return write_file_verified(
        file, as_bytes_view("x"), [](const fs::path&) -> Result<bool> { return true; }, roots);
  };
  for (const fs::path& file :
       {link / "a", outside / "a", inside / "../out/a", folder_ / "a", folder_ / "in2/a"}) {
    const Status refused = write_file_atomic(file, as_bytes_view("x"), roots);
    ASSERT_FALSE(refused.ok()) << file;
    EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(refused.error().message, HasSubstr("outside what --root allows"));
    EXPECT_FALSE(publish(file).ok()) << file;
  }
  EXPECT_TRUE(fs::is_empty(outside));
  fs::remove(link);
  fs::create_directory_symlink(inside / "real", link);
  EXPECT_TRUE(write_file_atomic(link / "a", as_bytes_view("x"), roots).ok());
  EXPECT_TRUE(publish(inside / "new/folder/a").ok());
  EXPECT_EQ(read_text_file(inside / "real/a", 10).value(), "x");
}

// It may have come since somebody looked, or be there for other machines alone.
TEST_F(FilesTest, WhatMayNotBeReplacedStays) {
  const fs::path file = folder_ / "frame";
  const auto publish = [&](const std::string& text, bool may_replace) {
    return write_file_verified(file, as_bytes_view(text),
                               [&](const fs::path&) -> Result<bool> { return may_replace; });
  };
  EXPECT_TRUE(publish("one", false).value());
  EXPECT_FALSE(publish("two", false).value());
  EXPECT_EQ(read_text_file(file, 100).value(), "one");
  EXPECT_TRUE(publish("three", true).value());
  EXPECT_EQ(read_text_file(file, 100).value(), "three");
  EXPECT_EQ(num_files(), 1);
}

TEST_F(FilesTest, AChangedByteIsNamed) {
  const fs::path file = folder_ / "file";
  ASSERT_TRUE(write_file_atomic(file, as_bytes_view("conxent")));
  const Status damaged = expect_content(file, as_bytes_view("content"));
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message, HasSubstr("byte 3 is 78 on disk, wrote 74"));
}

TEST_F(FilesTest, EveryChangedByteOfAFileIsSeen) {
  const fs::path file = folder_ / "file";
  const std::string good = "0123456789";
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = 'x';
    ASSERT_TRUE(write_file_atomic(file, as_bytes_view(bad)));
    const Status status = expect_content(file, as_bytes_view(good));
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().kind, ErrorKind::corrupt);
    EXPECT_THAT(status.error().message, HasSubstr("byte " + std::to_string(i) + " is 78"));
  }
  for (const std::string other : {"012345678", "01234567890", ""}) {
    ASSERT_TRUE(write_file_atomic(file, as_bytes_view(other)));
    EXPECT_FALSE(expect_content(file, as_bytes_view(good))) << other;
  }
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

// Links under every name that a counting writer would take, to a file that is not its own.
TEST_F(FilesTest, WritersFollowNoLinksThatLieInWait) {
  const fs::path victim = folder_ / "victim", target = folder_ / "out" / "a.txt";
  ASSERT_TRUE(write_file_atomic(victim, as_bytes_view("mine")));
  fs::create_directories(target.parent_path());
  for (int i = 0; i < 1000; ++i) {
    fs::create_symlink(victim, target.parent_path() / (".a.txt." + std::to_string(::getpid()) +
                                                       "." + std::to_string(i) + ".tmp"));
  }
  ASSERT_TRUE(write_file_atomic(target, as_bytes_view("one")));
  ASSERT_TRUE(write_file_unsynced(target, as_bytes_view("two")));
  ASSERT_TRUE(write_file_verified(target, as_bytes_view("three"),
                                  [](const fs::path& temporary) -> Result<bool> {
                                    EXPECT_FALSE(fs::is_symlink(temporary));
                                    return true;
                                  }));
  EXPECT_EQ(read_text_file(victim, 10).value(), "mine");
  EXPECT_EQ(read_text_file(target, 10).value(), "three");

  // A link in the place of the file itself is replaced, not followed.
  fs::remove(target);
  fs::create_symlink(victim, target);
  ASSERT_TRUE(write_file_atomic(target, as_bytes_view("four")));
  EXPECT_FALSE(fs::is_symlink(target));
  EXPECT_EQ(read_text_file(victim, 10).value(), "mine");
}

TEST_F(FilesTest, WhatIsNotPublishedLeavesNothing) {
  const auto refuse = [](const fs::path&) -> Result<bool> {
    return Error{ErrorKind::corrupt, "no"};
  };
  EXPECT_FALSE(write_file_verified(folder_ / "b.txt", as_bytes_view("one"), refuse));
  fs::create_directories(folder_ / "taken" / "inside");
  EXPECT_FALSE(write_file_atomic(folder_ / "taken", as_bytes_view("one")));
  for (const auto& entry : fs::directory_iterator(folder_))
    EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
}

}  // namespace
}  // namespace baton
