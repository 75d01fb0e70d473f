#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <deque>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>

#include "common/base/build.h"
#include "common/base/file_stamp.h"
#include "common/base/files.h"
#include "common/job/text/job_json.h"
#include "common/protocol/client.h"
#include "common/protocol/worker_channel.h"
#include "common/store/blob_store.h"
#include "coordinator/service/service.h"
#include "tests/support/farm_job.h"
#include "tests/support/patience.h"

namespace baton::testing_service {

/// Of the job of ServiceTest: two tiles in two runs, and four frames.
inline constexpr int kNumTasks = 8;

using namespace std::chrono_literals;
namespace fs = std::filesystem;

inline constexpr auto kPatience = with_patience(20s);
inline constexpr auto kHeartbeat = with_patience(500ms);

/// A coordinator in a thread of its own.
class RunningService {
 public:
  explicit RunningService(const ServiceOptions& options)
      : service_(Service::open(options).value()) {
    endpoint_ = service_.endpoint();
    thread_ = std::thread([this] { status_ = service_.run(stop_); });
  }
  ~RunningService() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  const std::string& endpoint() const { return endpoint_; }
  Status join() {
    thread_.join();
    return status_;
  }

 private:
  Service service_;
  std::string endpoint_;
  std::atomic<bool> stop_{false};
  Status status_;
  std::thread thread_;
};

/// A worker that talks but does not render: its blobs are the names of what they stand for.
class FakeWorker {
 public:
  FakeWorker(const std::string& endpoint, const fs::path& store, JobSpec job, std::string id = "w")
      : channel_(WorkerChannel::connect(endpoint).value()),
        store_(BlobStore::open(store).value()),
        job_(std::move(job)),
        id_(std::move(id)) {}

  void say(const Message& message) { ASSERT_TRUE(channel_.send(message)); }
  void hello(std::vector<LeaseId> running = {}, std::int32_t pid = 1,
             const std::string& renderer = "TEST") {
    say(WorkerHello{id_, "host", static_cast<std::uint64_t>(pid), pid, 2, build_identity(),
                    renderer, std::move(running)});
  }

  /// The next message of type T; others are passed over.
  template <class T>
  T expect() {
    for (const auto deadline = std::chrono::steady_clock::now() + kPatience;
         std::chrono::steady_clock::now() < deadline;) {
      const std::optional<Message> message = channel_.receive(100ms);
      if (message && std::holds_alternative<T>(*message)) return std::get<T>(*message);
    }
    ADD_FAILURE() << "no message of type " << Message(T{}).index() << " came";
    return T{};
  }

  /// Whether the next message, if one comes in time, has type T.
  template <class T>
  bool answers(std::chrono::milliseconds time) {
    const std::optional<Message> message = channel_.receive(time);
    return message && std::holds_alternative<T>(*message);
  }

  /// Publishes what the task makes and returns the report.
  TaskDone work(const LeaseId& lease) {
    TaskDone done{lease, {}};
    done.made.stats.pixels = 1;
    if (lease.task.kind == TaskKind::assemble) {
      const fs::path path = frame_path(job_, lease.task.frame());
      const std::string image = "image of seed " + std::to_string(job_.seed);
      EXPECT_TRUE(write_file_atomic(path, as_bytes_view(image)).ok());
      done.frame = stamp_of(path).value().value_or(FileStamp());
      done.made.outputs.push_back(
          {BlobKind::image, lease.task.position, 0, digest_of(image), image.size()});
      return done;
    }
    const TileRun run = tile_run(job_, lease.task.tile, lease.task.run());
    for (Step step = run.steps.first; step <= run.steps.last; ++step) {
      done.made.outputs.push_back(blob(BlobKind::film, step, run.tile));
      done.made.frames.push_back({step.value(), run.tile, {}});
      done.made.frames.back().sampling.pixels_carried = static_cast<std::uint64_t>(10 + run.tile);
    }
    if (carries_state(job_))
      done.made.outputs.push_back(blob(BlobKind::state, run.steps.last, run.tile));
    return done;
  }

  /// Does one task from request to report.
  LeaseId do_one_task() {
    say(LeaseRequest{1});
    const LeaseId lease = expect<LeaseGrant>().lease;
    say(work(lease));
    return lease;
  }

 private:
  BlobRef blob(BlobKind kind, Step step, int tile) {
    const std::string text = std::to_string(static_cast<int>(kind)) + " " +
                             std::to_string(step.value()) + " " + std::to_string(tile);
    return {kind, step.value(), tile, store_.put(as_bytes_view(text)).value(), text.size()};
  }

  WorkerChannel channel_;
  BlobStore store_;
  JobSpec job_;
  std::string id_;
};

/// A work folder and a job of 2 tiles, 4 frames in 2 runs: 8 tasks.
struct ServiceTest : testing::Test {
  fs::path folder =
      fs::path(testing::TempDir()) /
      (std::to_string(::getpid()) + testing::UnitTest::GetInstance()->current_test_info()->name());
  ServiceOptions options{"tcp://127.0.0.1:*", folder / "work", kHeartbeat};
  JobSpec job;
  std::string document;

  /// Its workers say nothing twice, and no disk is late.
  ServiceTest() { options.file_patience = 0ms; }

  void SetUp() override {
    fs::remove_all(folder);
    fs::create_directories(folder);
    job = test::farm_job(folder);
    const Result<std::string> made = make_job_document(job);
    ASSERT_TRUE(made.ok()) << made.error().message;
    document = *made;
  }
  void TearDown() override { fs::remove_all(folder); }

  fs::path store() const { return options.work_dir / "store"; }

  template <class T>
  T ask(const std::string& endpoint, const Message& question) {
    RequestClient client = RequestClient::connect(endpoint).value();
    const Result<Message> answer = client.request(question, kPatience);
    if (!answer.ok()) {
      ADD_FAILURE() << answer.error().message;
      return T{};
    }
    EXPECT_TRUE(std::holds_alternative<T>(*answer)) << answer->index();
    return std::holds_alternative<T>(*answer) ? std::get<T>(*answer) : T{};
  }
  Error refused(const std::string& endpoint, const Message& question) {
    RequestClient client = RequestClient::connect(endpoint).value();
    const Result<Message> answer = client.request(question, kPatience);
    EXPECT_FALSE(answer.ok());
    return answer.ok() ? Error{} : answer.error();
  }
  JobIdentity show_identity(const std::string& endpoint, const std::string& text) {
    return ask<ShownJob>(endpoint, ShowJob{text}).identity;
  }
  JobDetail show(const std::string& endpoint, const Digest& id) {
    return ask<ShownJob>(endpoint, ShowJob{id.hex()}).detail;
  }
  /// Once the frames of a job whose tasks are done have been looked at.
  JobDetail show_after(JobStatus status, const std::string& endpoint, const Digest& id) {
    JobDetail detail = show(endpoint, id);
    for (const auto deadline = std::chrono::steady_clock::now() + kPatience;
         detail.summary.status == status && std::chrono::steady_clock::now() < deadline;
         detail = show(endpoint, id))
      std::this_thread::sleep_for(10ms);
    return detail;
  }
  JobDetail show_end(const std::string& endpoint, const Digest& id) {
    return show_after(JobStatus::running, endpoint, id);
  }
};

}  // namespace baton::testing_service
