#include "common/job/text/roots.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct RootsTest : testing::Test {
  const fs::path top = fs::canonical(testing::TempDir()) / ("roots" + std::to_string(::getpid()));
  const Roots roots{top / "shows"};

  void SetUp() override {
    fs::create_directories(top / "shows/one");
    fs::create_directories(top / "elsewhere");
    std::ofstream(top / "elsewhere/map.hdr") << "x";
    fs::create_directory_symlink(top / "elsewhere", top / "shows/out");
    fs::create_directory_symlink(top / "not there", top / "shows/nowhere");
    fs::create_directory_symlink(top / "shows/one", top / "inside");
  }
  void TearDown() override { fs::remove_all(top); }
};

TEST_F(RootsTest, WhatLiesWithinIsKnownByItsParts) {
  EXPECT_TRUE(lies_within(top / "shows", roots));
  EXPECT_TRUE(lies_within(top / "shows/one/frames that are not there", roots));
  EXPECT_TRUE(lies_within(top / "inside/frames", roots)) << "a link from outside";
  EXPECT_FALSE(lies_within(top / "shows2", roots));
  EXPECT_FALSE(lies_within(top / "shows/../elsewhere", roots));
  EXPECT_FALSE(lies_within(top, roots));
  EXPECT_FALSE(lies_within("/", roots));
  EXPECT_TRUE(lies_within("/etc", {})) << "no roots, no rule";
}

TEST_F(RootsTest, LinksAreFollowed) {
  EXPECT_FALSE(lies_within(top / "shows/out", roots));
  EXPECT_FALSE(lies_within(top / "shows/out/deeper", roots));
  EXPECT_FALSE(lies_within(top / "shows/nowhere/deeper", roots)) << "who knows where it will lead";
}

TEST_F(RootsTest, AJobIsRefusedWithThePathAndWhereItLeads) {
  ParsedJobDocument document;
  document.job.output.directory = (top / "shows/one/frames").string();
  EXPECT_TRUE(check_roots(document, roots).ok());
  document.assets.push_back({(top / "shows/out/map.hdr").string(), {}});
  const Status asset = check_roots(document, roots);
  ASSERT_FALSE(asset.ok());
  EXPECT_EQ(asset.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(asset.error().message, HasSubstr((top / "elsewhere/map.hdr").string()));
  // Each part of a path is looked at: so many that it takes seconds are none of people.
  std::string deep = (top / "shows").string();
  for (int i = 0; i < 200; ++i) deep += "/x";
  document.assets.front().path = deep;
  const Status far = check_roots(document, roots);
  ASSERT_FALSE(far.ok());
  EXPECT_THAT(far.error().message, HasSubstr("has more than 128 folders"));
  document.job.output.directory = "/etc";
  EXPECT_THAT(check_roots(document, roots).error().message,
              HasSubstr("output.directory /etc lies outside what --root allows: "));
}

}  // namespace
}  // namespace baton
