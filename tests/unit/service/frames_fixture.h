#pragma once

#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "common/store/folder_token.h"
#include "coordinator/service/service.h"
#include "tests/unit/service/fake_farm.h"

namespace baton::testing_service {

/// A file that begins so is a whole picture; the rest names the job that wrote it.
inline constexpr std::string_view kPicture = "picture of ";

struct FramesTest : ServiceTest {
  std::atomic<int> num_read{0};
  /// File name of a frame that gives an error when it is read.
  std::atomic<const char*> broken = "";

  void SetUp() override {
    ServiceTest::SetUp();
    options.disk.read = [this](const fs::path& path) -> Result<Bytes> {
      if (path.filename() == broken.load())
        return Error{ErrorKind::io, path.string() + ": cannot read: Input/output error"};
      if (path.extension() == ".exr") ++num_read;
      return read_whole_file(path);
    };
    options.disk.picture_writer = [](const std::string&,
                                     const Bytes& bytes) -> std::optional<std::string> {
      const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      if (!text.starts_with(kPicture)) return std::nullopt;
      return text.substr(kPicture.size());
    };
  }

  fs::path frame(int number) const {
    return fs::path(job.output.directory) / ("frame.000" + std::to_string(number) + ".exr");
  }
  void put(int number, const std::string& text) const {
    ASSERT_TRUE(write_file_atomic(frame(number), as_bytes_view(text)).ok());
  }
  fs::path mark(const Digest& id) const {
    return output_token_file(job.output.directory, id,
                             read_text_file(store() / "token", 100).value());
  }

  /// Submits the job, has its folder marked, and does all but its last task.
  Digest begin(const std::string& endpoint, FakeWorker& worker) {
    const Digest id = ask<JobAccepted>(endpoint, SubmitJob{document}).version;
    worker.hello();
    worker.say(JobDocumentRequest{id});
    EXPECT_FALSE(worker.expect<JobDocument>().token.empty());
    for (int i = 0; i < kNumTasks - 1; ++i) worker.do_one_task();
    sync(worker);
    return id;
  }
  /// From now on what FakeWorker writes is a picture, of nobody that is known.
  void take_images_for_pictures() {
    options.disk.picture_writer = [](const std::string&, const Bytes& bytes) {
      const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      return text.starts_with("image of") ? std::optional(text) : std::nullopt;
    };
  }
  /// Submits the job as it was before: of another priority. Its digest.
  Digest submit_former(const std::string& endpoint) {
    JobSpec former = job;
    former.priority = 7;
    return ask<JobAccepted>(endpoint, SubmitJob{make_job_document(former).value()}).version;
  }
  /// The writer of its frames, as the worker of this build that rendered them has it.
  static std::string writer_of(const Digest& version) {
    return version.hex() + " TEST, " + build_identity();
  }
  /// Does what there is until it has the assembly of frame 2, which it does not do.
  LeaseId wait_for_frame_2(FakeWorker& worker) {
    for (int i = 0; i < 20; ++i) {
      worker.say(LeaseRequest{1});
      const LeaseGrant grant = worker.expect<LeaseGrant>();
      granted = grant.may_replace;
      if (grant.lease.task == assemble_task(FrameIndex(1))) return grant.lease;
      worker.say(worker.work(grant.lease));
    }
    ADD_FAILURE() << "frame 2 is not asked for";
    return {};
  }
  /// LeaseGrant::may_replace of its last grant.
  std::vector<Digest> granted;

  /// Does what there is, until the job has ended.
  JobDetail finish(const std::string& endpoint, FakeWorker& worker, const Digest& id) {
    for (const auto deadline = std::chrono::steady_clock::now() + kPatience;
         std::chrono::steady_clock::now() < deadline;) {
      sync(worker);  // what it has said is known
      const JobDetail detail = show(endpoint, id);
      if (detail.summary.status != JobStatus::running) return detail;
      if (detail.summary.tasks_done == detail.summary.tasks_total) continue;
      worker.do_one_task();
      sync(worker);
    }
    ADD_FAILURE() << "the job does not end";
    return show(endpoint, id);
  }
  std::vector<FrameNumber> locked_frames(const std::string& endpoint, const Digest& id) {
    return ask<ShownJob>(endpoint, ShowJob{id.hex()}).locked;
  }
  static void sync(FakeWorker& worker) {
    worker.say(LeaseRequest{0});
    worker.say(Heartbeat{});
    worker.expect<Heartbeat>();
  }
};

}  // namespace baton::testing_service
