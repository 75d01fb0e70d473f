#include "common/store/blob_store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "common/base/files.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// A store in an empty folder of its own.
class BlobStoreTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / "baton_store" / info->name();
    fs::remove_all(folder_);
  }
  BlobStore open() const { return *BlobStore::open(folder_); }
  auto num_files() const {
    std::ptrdiff_t count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder_))
      count += entry.is_regular_file();
    return count;
  }

  fs::path folder_;
};

std::string text_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST_F(BlobStoreTest, GivesBackWhatWasPut) {
  BlobStore store = open();
  const Result<Digest> digest = store.put(as_bytes_view("film"));
  ASSERT_TRUE(digest.ok()) << digest.error().message;
  EXPECT_EQ(*digest, digest_of("film"));
  EXPECT_TRUE(store.contains(*digest));
  EXPECT_EQ(text_of(*store.get(*digest)), "film");
  EXPECT_TRUE(store.get(*store.put({}))->empty());
}

TEST_F(BlobStoreTest, BlobsOutliveTheStoreObject) {
  const Digest digest = *open().put(as_bytes_view("state"));
  EXPECT_EQ(text_of(*open().get(digest)), "state");
}

// A small job has few blobs: 256 folders would take longer than it does.
TEST_F(BlobStoreTest, FoldersComeWithTheirFirstBlob) {
  BlobStore store = open();
  EXPECT_TRUE(fs::is_directory(folder_));
  EXPECT_TRUE(fs::is_empty(folder_));
  const fs::path file = store.path(*store.put(as_bytes_view("film")));
  EXPECT_TRUE(fs::is_regular_file(file));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(BlobStoreTest, NamesAreTheDigestSplitAfterTwoDigits) {
  const BlobStore store = open();
  const Digest digest{0xab23456789abcdefull, 0x1ull};
  EXPECT_EQ(store.path(digest), folder_ / "ab" / "23456789abcdef0000000000000001.blob");
}

TEST_F(BlobStoreTest, PuttingAgainIsASuccessAndLeavesOneFile) {
  BlobStore store = open();
  const Digest first = *store.put(as_bytes_view("film"));
  EXPECT_EQ(*store.put(as_bytes_view("film")), first);
  EXPECT_EQ(num_files(), 1);
}

// What was waited for must not be replaced by what a power cut takes.
TEST_F(BlobStoreTest, PuttingAgainLeavesTheFileThatIsThereAndMakesItYoung) {
  BlobStore store = open();
  const fs::path file = store.path(*store.put(as_bytes_view("state")));
  const fs::path same_file = folder_ / "same_file";
  fs::create_hard_link(file, same_file);
  const auto long_ago = fs::file_time_type::clock::now() - 2 * BlobStore::kLeftoverAge;
  fs::last_write_time(file, long_ago);
  ASSERT_EQ(store.old_blobs().size(), 1u);
  ASSERT_TRUE(store.put(as_bytes_view("state")).ok());
  EXPECT_TRUE(fs::equivalent(file, same_file));
  EXPECT_TRUE(store.old_blobs().empty());
}

TEST_F(BlobStoreTest, ADamagedBlobIsFoundAndMended) {
  BlobStore store = open();
  const Digest digest = *store.put(as_bytes_view("film"));
  ASSERT_TRUE(write_file_atomic(store.path(digest), as_bytes_view("fi")).ok());
  const Result<Bytes> damaged = store.get(digest);
  ASSERT_FALSE(damaged.ok());
  EXPECT_EQ(damaged.error().kind, ErrorKind::corrupt);
  EXPECT_EQ(damaged.error().message, store.path(digest).string() + ": digest " +
                                         digest_of("fi").hex() + ", expected " + digest.hex());
  ASSERT_TRUE(store.put(as_bytes_view("film")).ok());
  EXPECT_EQ(text_of(*store.get(digest)), "film");
}

TEST_F(BlobStoreTest, AMissingBlobIsAnIoErrorWithItsPath) {
  const BlobStore store = open();
  const Digest digest = digest_of("never put");
  EXPECT_FALSE(store.contains(digest));
  const Result<Bytes> bytes = store.get(digest);
  ASSERT_FALSE(bytes.ok());
  EXPECT_EQ(bytes.error().kind, ErrorKind::io);
  EXPECT_THAT(bytes.error().message, HasSubstr(store.path(digest).string()));
}

TEST_F(BlobStoreTest, RemovingTwiceIsASuccess) {
  BlobStore store = open();
  const Digest digest = *store.put(as_bytes_view("film"));
  EXPECT_TRUE(store.remove(digest).ok());
  EXPECT_FALSE(store.contains(digest));
  EXPECT_TRUE(store.remove(digest).ok());
}

TEST_F(BlobStoreTest, AFolderThatCannotBeMadeIsAnError) {
  ASSERT_TRUE(write_file_atomic(folder_, as_bytes_view("a file")).ok());
  const auto store = BlobStore::open(folder_);
  ASSERT_FALSE(store.ok());
  EXPECT_THAT(store.error().message, HasSubstr(folder_.string()));
}

// As several workers do: each thread has its own store on one folder, all put the same blobs and
// read them at once.
TEST_F(BlobStoreTest, ManyWritersOfTheSameBlobsNeverShowHalfOfOne) {
  const std::string blobs[] = {std::string(100000, 'a'), std::string(50000, 'b')};
  std::vector<int> faults(4, 0);
  std::vector<std::thread> threads;
  for (int& count : faults) {
    threads.emplace_back([&, this] {
      BlobStore store = open();
      for (int round = 0; round < 10; ++round) {
        for (const std::string& blob : blobs) {
          const Result<Digest> digest = store.put(as_bytes_view(blob));
          if (!digest || !store.get(*digest)) ++count;
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(faults, std::vector<int>(4, 0));
  EXPECT_EQ(num_files(), 2);
}

TEST_F(BlobStoreTest, SweepsWhatTheDeadLeftAndNothingElse) {
  BlobStore store = open();
  const Digest digest = *store.put(as_bytes_view("blob"));
  const fs::path old = folder_ / "00" / ".a.blob.1.1.tmp",
                 young = folder_ / "00" / ".b.blob.1.2.tmp";
  for (const fs::path& path : {old, young})
    ASSERT_TRUE(write_file_atomic(path, as_bytes_view("x")).ok());
  const auto long_ago = fs::file_time_type::clock::now() - 2 * BlobStore::kLeftoverAge;
  fs::last_write_time(old, long_ago);
  fs::last_write_time(store.path(digest), long_ago);
  EXPECT_EQ(store.clean_up(), 1u);
  EXPECT_FALSE(fs::exists(old));
  EXPECT_TRUE(fs::exists(young));
  EXPECT_TRUE(store.contains(digest));
}

TEST_F(BlobStoreTest, NamesBlobsAndJobFilesThatNobodyHasTouchedForLong) {
  BlobStore store = open();
  const Digest old = *store.put(as_bytes_view("old blob")), young = *store.put(as_bytes_view("x"));
  const Digest job = digest_of("job"), other = digest_of("another");
  fs::create_directories(folder_ / "jobs");
  for (const fs::path& path : {store.job_file(job), store.job_file(other), folder_ / "00/ab.blob"})
    ASSERT_TRUE(write_file_atomic(path, as_bytes_view("x")).ok());
  const auto long_ago = fs::file_time_type::clock::now() - 2 * BlobStore::kLeftoverAge;
  for (const fs::path& path : {store.path(old), store.job_file(job), folder_ / "00/ab.blob"})
    fs::last_write_time(path, long_ago);
  const auto blobs = store.old_blobs();
  ASSERT_EQ(blobs.size(), 1u) << "a file that no digest names is none";
  EXPECT_EQ(blobs[0].digest, old);
  EXPECT_EQ(blobs[0].size_bytes, 8u);
  EXPECT_EQ(store.old_job_files(), std::vector<Digest>{job});
  // Whoever puts it once more needs it.
  ASSERT_TRUE(store.put(as_bytes_view("old blob")).ok());
  EXPECT_TRUE(store.old_blobs().empty());
  EXPECT_TRUE(store.contains(young));
}

// What stands in a blob's place makes way.
TEST_F(BlobStoreTest, AFolderInThePlaceOfABlobIsReplaced) {
  BlobStore store = open();
  const std::string text = "bytes";
  const fs::path file = store.path(digest_of(text));
  fs::create_directories(file / "full");
  EXPECT_FALSE(store.contains(digest_of(text)));
  EXPECT_FALSE(store.get(digest_of(text)).ok());
  ASSERT_TRUE(store.put(as_bytes_view(text)).ok());
  EXPECT_TRUE(store.get(digest_of(text)).ok());
  fs::remove(file);
  fs::create_directories(file / "full");
  EXPECT_TRUE(store.remove(digest_of(text)).ok());
  EXPECT_FALSE(fs::exists(file));
}

}  // namespace
}  // namespace baton
