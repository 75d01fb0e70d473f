#include <gmock/gmock.h>

#include <algorithm>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>

#include "coordinator/service/service.h"
#include "tests/unit/service/fake_farm.h"

/// A disk that takes minutes for a file: nobody but who asks for the file may notice.
namespace baton {
namespace {

using namespace testing_service;
using testing::HasSubstr;
using testing::SizeIs;

/// Reads files only while it is let.
class SlowDisk {
 public:
  Result<Bytes> read(const fs::path& path) {
    std::unique_lock lock(mutex_);
    ++num_begun_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return is_fast_; });
    return read_whole_file(path);
  }
  void be(bool fast) {
    const std::lock_guard lock(mutex_);
    is_fast_ = fast;
    num_begun_ = 0;
    changed_.notify_all();
  }
  bool has_begun() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [this] { return num_begun_ > 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_fast_ = true;
  int num_begun_ = 0;
};

struct SlowDiskTest : ServiceTest {
  SlowDisk disk;
  /// A service ends only when the file in hand is read, so tests must leave the disk fast.
  struct Slow {
    explicit Slow(SlowDisk& slow) : disk(slow) { disk.be(false); }
    ~Slow() { disk.be(true); }
    SlowDisk& disk;
  };

  void SetUp() override {
    ServiceTest::SetUp();
    options.disk.read = [this](const fs::path& path) { return disk.read(path); };
  }

  static void sync(FakeWorker& worker) {
    worker.say(LeaseRequest{0});
    worker.say(Heartbeat{});
    worker.expect<Heartbeat>();
  }
  /// Submits the job and does all of it, or but for some tasks. Its frames must be read then.
  Digest do_job(const std::string& endpoint, FakeWorker& worker, int num_open = 0) {
    const Digest id = ask<JobAccepted>(endpoint, SubmitJob{document}).version;
    worker.hello();
    for (int i = 0; i < kNumTasks - num_open; ++i) worker.do_one_task();
    sync(worker);
    if (num_open == 0) {
      EXPECT_EQ(show_end(endpoint, id).summary.status, JobStatus::done);
    }
    // Another time, so that only their bytes can tell whether they are those of the reports.
    for (const auto& file : fs::directory_iterator(job.output.directory)) {
      if (file.path().extension() == ".exr")
        fs::last_write_time(file, file.last_write_time() + std::chrono::seconds(1));
    }
    return id;
  }

  /// Asks again for as long as the coordinator says that it is not done.
  template <class T>
  T ask_until_done(const std::string& endpoint, const Message& question) {
    RequestClient client = RequestClient::connect(endpoint).value();
    for (;;) {
      Result<Message> answer = client.request(question, kPatience);
      if (!client.pending().empty()) continue;
      EXPECT_TRUE(answer.ok()) << answer.error().message;
      return std::get<T>(*answer);
    }
  }
  /// Whether the worker hears the coordinator while the disk reads.
  void expect_alive(FakeWorker& worker) {
    ASSERT_TRUE(disk.has_begun());
    worker.hello();  // it may have been silent for too long
    EXPECT_TRUE(worker.answers<WorkerWelcome>(5 * kHeartbeat)) << "as if nobody were there";
    for (int i = 0; i < 3; ++i) {
      worker.say(Heartbeat{});
      EXPECT_TRUE(worker.answers<Heartbeat>(5 * kHeartbeat)) << "as if nobody were there";
    }
  }
};

TEST_F(SlowDiskTest, NobodyWaitsForTheFramesOfASubmission) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  do_job(service.endpoint(), worker);

  // Whoever submits is told why there is no answer yet, each time that he asks.
  std::optional<Slow> slow(disk);
  RequestClient client = RequestClient::connect(service.endpoint()).value();
  for (int i = 0; i < 2; ++i) {
    const Result<Message> answer = client.request(SubmitJob{document}, kPatience);
    ASSERT_FALSE(answer.ok());
    EXPECT_EQ(answer.error().kind, ErrorKind::timeout);
    EXPECT_EQ(client.pending(), "job 'test': looking at 4 frames in " + job.output.directory);
  }
  expect_alive(worker);
  slow.reset();
  EXPECT_TRUE(ask_until_done<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);

  // What is known is not read again, unless it has changed.
  slow.emplace(disk);
  EXPECT_TRUE(ask<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);
  slow.reset();
  const fs::path frame = fs::path(job.output.directory) / "frame.0003.exr";
  const std::string other(fs::file_size(frame), 'x');
  ASSERT_TRUE(write_file_atomic(frame, as_bytes_view(other)).ok());
  const auto again = ask_until_done<JobAccepted>(service.endpoint(), SubmitJob{document});
  EXPECT_FALSE(again.already_there);
  EXPECT_THAT(again.plan, HasSubstr("frame.0003.exr is gone, or not as it was last written"));
}

// The frames of another picture are looked at before anything is replaced.
TEST_F(SlowDiskTest, NothingHappensBeforeTheFramesAreRead) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = do_job(service.endpoint(), worker);
  JobSpec other = job;
  other.seed = 99;
  const Message question = SubmitJob{make_job_document(other).value(), true};
  {
    const Slow slow(disk);
    EXPECT_EQ(refused(service.endpoint(), question).kind, ErrorKind::timeout);
    expect_alive(worker);
    EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
    EXPECT_THAT(ask<JobList>(service.endpoint(), ListJobs{}).jobs, SizeIs(0));
  }
  EXPECT_THAT(ask_until_done<JobAccepted>(service.endpoint(), question).plan,
              HasSubstr("replaced: $.seed differs"));
}

// The answer is the promise: who has none asks the next coordinator.
TEST_F(SlowDiskTest, ASubmissionThatIsNotAnsweredLeavesNothing) {
  Digest id;
  {
    const RunningService service(options);
    FakeWorker worker(service.endpoint(), store(), job);
    id = do_job(service.endpoint(), worker);
    fs::remove(fs::path(job.output.directory) / "frame.0003.exr");
    const Slow slow(disk);
    EXPECT_EQ(refused(service.endpoint(), SubmitJob{document}).kind, ErrorKind::timeout);
  }
  const RunningService service(options);
  EXPECT_EQ(show_end(service.endpoint(), id).summary.status, JobStatus::done);
  EXPECT_FALSE(ask_until_done<JobAccepted>(service.endpoint(), SubmitJob{document}).already_there);
  EXPECT_THAT(show(service.endpoint(), id).frames_done, SizeIs(3));
}

TEST_F(SlowDiskTest, NobodyWaitsForTheFramesOfAPausedJob) {
  const RunningService service(options);
  FakeWorker worker(service.endpoint(), store(), job);
  const Digest id = do_job(service.endpoint(), worker, 1);
  ask<ShownJob>(service.endpoint(), PauseJob{id.hex()}).detail;
  std::optional<Slow> slow(disk);
  EXPECT_EQ(refused(service.endpoint(), ResumeJob{id.hex()}).kind, ErrorKind::timeout);
  EXPECT_EQ(refused(service.endpoint(), SubmitJob{document}).kind, ErrorKind::timeout);
  expect_alive(worker);
  EXPECT_EQ(show(service.endpoint(), id).summary.status, JobStatus::paused);
  slow.reset();
  const auto resumed = ask_until_done<ShownJob>(service.endpoint(), ResumeJob{id.hex()});
  EXPECT_EQ(resumed.detail.summary.status, JobStatus::running);
}

// A report that waits is not confirmed; said twice, it is one failure.
TEST_F(SlowDiskTest, NobodyWaitsForTheInputsOfAFailedAttempt) {
  const RunningService service(options);
  const Digest id = ask<JobAccepted>(service.endpoint(), SubmitJob{document}).version;
  FakeWorker worker(service.endpoint(), store(), job);
  worker.hello();
  for (int i = 0; i < 2; ++i) worker.do_one_task();
  worker.say(LeaseRequest{1});
  const LeaseGrant reader = worker.expect<LeaseGrant>();
  ASSERT_FALSE(reader.inputs.empty());
  {
    const Slow slow(disk);
    worker.say(TaskFailed{reader.lease, "cannot read", false});
    ASSERT_TRUE(disk.has_begun());
    worker.say(TaskFailed{reader.lease, "cannot read", false});
    worker.say(Heartbeat{{reader.lease}});
    EXPECT_TRUE(worker.answers<Heartbeat>(5 * kHeartbeat)) << "as if nobody were there";
    EXPECT_THAT(show(service.endpoint(), id).failures, SizeIs(0));
  }
  EXPECT_EQ(worker.expect<ReportReceived>().lease, reader.lease);
  EXPECT_THAT(show(service.endpoint(), id).failures, SizeIs(1));
}

/// A file of its own for each test.
struct FileTableTest : ServiceTest {
  fs::path file = folder / "frame";
  BlobRef blob{BlobKind::film, 0, 0, digest_of("bytes"), 5};
  BlobRef frame{BlobKind::image, 0, 0, digest_of("bytes"), 5};
  void write(const std::string& text) {
    ASSERT_TRUE(write_file_atomic(file, as_bytes_view(text)).ok());
  }
  FileContent read() { return {file, *stamp_of(file), digest_of(*read_whole_file(file)), {}}; }
};

TEST_F(FileTableTest, AFileIsReadOnceAndAgainWhenItHasChanged) {
  FileTable table;
  EXPECT_EQ(table.judge(file, frame).state, FileState::absent);
  write("bytes");
  EXPECT_EQ(table.judge(file, frame).state, FileState::unknown);
  table.add(read());
  EXPECT_EQ(table.judge(folder / "." / "frame", frame).state, FileState::right);
  EXPECT_EQ(table.stamp_with(file, frame.digest), *stamp_of(file));

  // The same size, at the same time.
  const auto time = fs::last_write_time(file);
  write("other");
  fs::last_write_time(file, time);
  EXPECT_EQ(table.judge(file, frame).state, FileState::unknown) << "another inode";
  table.add(read());
  EXPECT_EQ(table.judge(file, frame).state, FileState::damaged);
  EXPECT_EQ(table.stamp_with(file, frame.digest), std::nullopt);
  write("longer");
  EXPECT_EQ(table.judge(file, blob).state, FileState::damaged) << "the size says it";
  EXPECT_EQ(table.judge(file, frame).state, FileState::unknown) << "it may be a picture";
  FileContent picture = read();
  picture.writer = "somebody";
  table.add(picture);
  EXPECT_EQ(table.judge(file, frame).state, FileState::strange);
  EXPECT_EQ(table.judge(file, frame).writer, "somebody");
}

// One of megabytes takes seconds, and everybody else would wait for it.
TEST_F(FileTableTest, LargeDocumentsAreParsedBesideTheLoop) {
  std::atomic<int> num_woken = 0;
  FileWaits waits({}, [&] { ++num_woken; });
  FileTable table;
  const TimePoint now = std::chrono::steady_clock::now();
  const auto from = [](const std::string& peer, const std::string& speaker) {
    const ByteView bytes = as_bytes_view(peer);
    return Incoming{PeerId(bytes.begin(), bytes.end()), Message(ListJobs{}), {Role::user, speaker}};
  };
  const auto large = [](char letter) {
    return std::string(2 * FileWaits::kParsedAtOnceBytes, letter);
  };
  using Parsing = FileWaits::Parsing;
  EXPECT_EQ(waits.parse(from("1", "anna"), {{}, {"{}", "small"}}, now), Parsing::done);
  EXPECT_EQ(waits.parse(from("1", "anna"), {{}, {large('a')}}, now), Parsing::waits);
  EXPECT_EQ(waits.parse(from("2", "anna"), {{}, {large('b')}}, now), Parsing::no_place)
      << "one of a speaker at a time";
  EXPECT_EQ(waits.parse(from("3", "ben"), {{}, {large('c'), document}}, now), Parsing::waits);

  std::vector<Incoming> ready;
  const auto deadline = now + kPatience;
  while (ready.size() < 2 && std::chrono::steady_clock::now() < deadline) {
    for (Incoming& message : waits.take_ready(table, std::chrono::steady_clock::now())) {
      // What it waited for is at hand while it is handled: why it is no document, too.
      const bool is_anna = message.speaker.name == "anna";
      const SharedDocument known = document_at_hand(digest_of(large(is_anna ? 'a' : 'c')));
      ASSERT_NE(known, nullptr);
      EXPECT_FALSE(known->parsed.ok());
      EXPECT_EQ(waits.parse(message, {{}, {large(is_anna ? 'a' : 'c')}}, now), Parsing::done);
      ready.push_back(std::move(message));
    }
    std::this_thread::sleep_for(1ms);
  }
  ASSERT_EQ(ready.size(), 2u);
  EXPECT_GE(num_woken, 2);
  const SharedDocument parsed = document_at_hand(digest_of(document));
  ASSERT_NE(parsed, nullptr);
  EXPECT_TRUE(parsed->parsed.ok());
  EXPECT_TRUE(parsed->written.ok());
  EXPECT_EQ(waits.parse(from("2", "anna"), {{}, {large('b')}}, now), Parsing::waits);
}

// The journal may have it from an earlier build, whose frames are still a job's.
TEST_F(FileTableTest, ADocumentThatIsWrittenOtherwiseIsOne) {
  const SharedDocument other = share_document(document + " ");
  EXPECT_TRUE(other->parsed.ok());
  EXPECT_FALSE(other->written.ok());
  EXPECT_TRUE(parse_farm_document(document + " ").ok());
}

// Written by a machine whose clock is ahead, changed in place, and its date put back.
TEST_F(FileTableTest, ADateInTheFutureHidesNoChange) {
  FileTable table;
  write("bytes");
  const auto ahead = fs::last_write_time(file) + std::chrono::hours(1);
  fs::last_write_time(file, ahead);
  table.add(read());
  EXPECT_EQ(table.judge(file, frame).state, FileState::right);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the kernel's clock goes on
  std::ofstream(file, std::ios::in | std::ios::out) << "other";
  fs::last_write_time(file, ahead);
  EXPECT_EQ(table.judge(file, frame).state, FileState::unknown);
}

// It takes no disk, and would take the coordinator's memory.
TEST_F(FileTableTest, AHugeFileOfASizeThatNoFrameHasIsNotRead) {
  write("bytes");
  fs::resize_file(file, FileToRead::kMaxStrangeBytes + 1);
  int reads = 0;
  Disk disk;
  disk.read = [&](const fs::path&) -> Result<Bytes> {
    ++reads;
    return Bytes();
  };
  disk.picture_writer = [](const std::string&, const Bytes&) {
    return std::optional<std::string>();
  };
  FileReader reader(disk, [] {});
  FileToRead frame_file{.path = file, .is_frame = true};
  for (const bool has_size : {false, true}) {
    if (has_size) frame_file.sizes = {FileToRead::kMaxStrangeBytes + 1};
    ASSERT_TRUE(reader.request(InspectionOf{}, {frame_file}));
    std::vector<FilesRead> read;
    while (read.empty()) read = reader.take();
    EXPECT_EQ(reads, has_size ? 1 : 0);
    EXPECT_EQ(read.front().contents.front().fault.empty(), has_size);
  }
}

TEST_F(FileTableTest, WhatCannotBeReadIsNeitherThereNorGone) {
  FileTable table;
  write("bytes");
  FileContent content = read();
  content.digest.reset();
  content.fault = "frame: cannot read";
  table.add(content);
  EXPECT_EQ(table.judge(file, frame).state, FileState::unreadable);
  EXPECT_EQ(table.judge(file, frame).fault, "frame: cannot read");
  table.forget_unread();
  EXPECT_EQ(table.judge(file, frame).state, FileState::unknown) << "read anew";
  fs::remove(file);
  fs::create_directories(file);
  EXPECT_EQ(table.judge(file, frame).state, FileState::unreadable);
  EXPECT_THAT(table.judge(file, frame).fault, HasSubstr("is a folder, expected a file"));
}

// One file of each in turn: the short request is done before the long one.
TEST_F(FileTableTest, AShortRequestDoesNotWaitForALongOne) {
  write("bytes");
  SlowDisk disk;
  disk.be(false);
  std::atomic<int> num_woken{0};
  FileReader reader({.read = [&](const fs::path& path) { return disk.read(path); }},
                    [&] { ++num_woken; });
  const ReadFor longer = Digest{1, 1}, shorter = LeaseId{};
  ASSERT_TRUE(reader.request(longer, std::vector<FileToRead>(5, FileToRead{file})));
  ASSERT_TRUE(disk.has_begun());
  ASSERT_TRUE(reader.request(shorter, {{file}, {folder / "gone"}}));
  for (std::size_t i = 2; i < FileReader::kMaxRequests; ++i)
    ASSERT_TRUE(reader.request(longer, {}));
  EXPECT_FALSE(reader.request(longer, {})) << "the queue is full";
  disk.be(true);
  std::vector<FilesRead> done;
  while (done.size() < FileReader::kMaxRequests) {
    for (FilesRead& read : reader.take()) done.push_back(std::move(read));
  }
  const auto place = [&](const ReadFor& reason, std::size_t size) {
    return std::find_if(done.begin(), done.end(), [&](const FilesRead& read) {
      return read.reason == reason && read.contents.size() == size;
    });
  };
  ASSERT_NE(place(shorter, 2), done.end());
  EXPECT_EQ(place(shorter, 2)->contents[0].digest, digest_of("bytes"));
  EXPECT_EQ(place(shorter, 2)->contents[1].stamp, std::nullopt) << "it is gone";
  EXPECT_LT(place(shorter, 2), place(longer, 5));
  EXPECT_EQ(num_woken, static_cast<int>(FileReader::kMaxRequests));
}

// A frame that stands as it did at its report is not read.
TEST_F(FileTableTest, OnlyWhatHasChangedIsRead) {
  write("bytes");
  std::atomic<int> num_read{0}, num_decoded{0};
  FileReader reader(
      {.read =
           [&](const fs::path& path) {
             ++num_read;
             return read_whole_file(path);
           },
       .picture_writer = [&](const std::string&, const Bytes&) -> std::optional<std::string> {
         ++num_decoded;
         return "me";
       }},
      [] {});
  const auto read_one = [&](const FileToRead& wanted) {
    EXPECT_TRUE(reader.request(Digest{1, 1}, {wanted}));
    for (;;) {
      std::vector<FilesRead> done = reader.take();
      if (!done.empty()) return done.at(0).contents.at(0);
    }
  };
  const FileStamp stamp = stamp_of(file).value().value();
  EXPECT_EQ(read_one({file, {frame.digest}, stamp}).digest, frame.digest);
  EXPECT_EQ(num_read, 0);
  FileStamp older = stamp;
  --older.time_ns;
  EXPECT_EQ(read_one({file, {frame.digest}, older}).writer, std::nullopt);
  EXPECT_EQ(num_read, 1);
  EXPECT_EQ(num_decoded, 0);
  EXPECT_EQ(read_one({file, {digest_of("others")}, stamp}).digest, digest_of("others"))
      << "as long as it stands so";
  EXPECT_EQ(read_one({file, {digest_of("others")}, older}).writer, "me");
  EXPECT_EQ(num_decoded, 1);
}

TEST_F(FileTableTest, AReaderEndsWithRequestsInHand) {
  write("bytes");
  FileReader reader({}, [] {});
  ASSERT_TRUE(reader.request(Digest{1, 1}, std::vector<FileToRead>(100000, FileToRead{file})));
}

}  // namespace
}  // namespace baton
