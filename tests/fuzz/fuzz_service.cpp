#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>

#include "common/base/build.h"
#include "common/job/text/job_json.h"
#include "coordinator/service/service.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/farm_job.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Who says something: workers, a viewer, two users, an admin, and somebody where there are no
/// keys.
const std::array<Speaker, 8> kSpeakers{Speaker{Role::worker, "one"},  Speaker{Role::worker, "two"},
                                       Speaker{Role::worker, "two"},  Speaker{Role::viewer, "eye"},
                                       Speaker{Role::user, "owner"},  Speaker{Role::user, "other"},
                                       Speaker{Role::admin, "admin"}, Speaker{}};
constexpr int kOwner = 4;
/// A coordinator begins anew after so many inputs: what it knows grows.
constexpr int kLifetime = 200;
/// Stands in an input for the digest of the job, which depends on where the test runs.
constexpr std::uint64_t kJob = 0xaaaaaaaaaaaaaaaa;

/// A coordinator with a job of two tiles and four frames, and two workers.
class Coordinator {
 public:
  Coordinator() {
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "out");
    const JobSpec job = test::farm_job(folder_);
    const std::string document = make_job_document(job).value();
    job_ = digest_of(document);
    ServiceOptions options{"inproc://fuzz", folder_ / "work"};
    options.roots = {folder_};
    options.file_patience = std::chrono::milliseconds(0);
    service_.emplace(Service::open(options).value());
    say(kOwner, Message(SubmitJob{document}));
    for (const int worker : {0, 1}) {
      say(worker, Message(WorkerHello{kSpeakers[static_cast<std::size_t>(worker)].name,
                                      "host",
                                      static_cast<std::uint64_t>(worker),
                                      worker,
                                      2,
                                      build_identity(),
                                      "TEST",
                                      {}}));
      say(worker, Message(LeaseRequest{4}));
    }
  }
  ~Coordinator() {
    service_.reset();
    fs::remove_all(folder_);
  }

  void say(int peer, Result<Message> message) {
    const Bytes name{std::byte{0}, static_cast<std::byte>(peer)};
    const Incoming incoming{name, std::move(message), kSpeakers[static_cast<std::size_t>(peer)]};
    BATON_CHECK(service_->handle(incoming).ok());
  }
  void end_turn() { BATON_CHECK(service_->end_turn().ok()); }
  const Digest& job() const { return job_; }

 private:
  fs::path folder_ =
      fs::temp_directory_path() / ("baton-fuzz-service-" + std::to_string(::getpid()));
  Digest job_;
  std::optional<Service> service_;
};

/// Gives the input the digest of the job, in the bytes and as text.
Bytes with_job(ByteView input, const Digest& job) {
  Bytes bytes(input.begin(), input.end());
  std::array<std::uint64_t, 2> known{kJob, kJob}, real{job.high, job.low};
  const auto replace = [&bytes](ByteView from, ByteView to) {
    for (auto at = bytes.begin();
         (at = std::search(at, bytes.end(), from.begin(), from.end())) != bytes.end();)
      at = std::copy(to.begin(), to.end(), at);
  };
  replace(std::as_bytes(std::span(known)), std::as_bytes(std::span(real)));
  const std::string text = Digest{kJob, kJob}.hex(), real_text = job.hex();
  replace(as_bytes_view(text), as_bytes_view(real_text));
  return bytes;
}

}  // namespace
}  // namespace baton

/// An input is a conversation: of each message who says it, its type, the length of its body, and
/// the body. The coordinator goes on, whatever is said.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace baton;
  static std::unique_ptr<Coordinator> coordinator;
  static int age = 0;
  if (coordinator == nullptr || ++age >= kLifetime) {
    spdlog::set_level(spdlog::level::off);
    coordinator.reset();
    coordinator = std::make_unique<Coordinator>();
    age = 0;
  }
  constexpr std::size_t kHeader = 1 + 2 * sizeof(std::uint16_t);
  Bytes input = with_job(fuzz_input(data, size), coordinator->job());
  for (std::size_t at = 0; at + kHeader <= input.size();) {
    std::uint16_t length = 0;
    std::memcpy(&length, &input[at + 3], sizeof(length));
    const int peer = static_cast<int>(input[at]) % static_cast<int>(kSpeakers.size());
    std::vector<Bytes> frames = encode_message(ListJobs{});
    const auto begin = input.begin() + static_cast<std::ptrdiff_t>(at + kHeader);
    const auto count =
        static_cast<std::ptrdiff_t>(std::min<std::size_t>(length, input.size() - at - kHeader));
    frames[1].assign(input.begin() + static_cast<std::ptrdiff_t>(at + 1),
                     input.begin() + static_cast<std::ptrdiff_t>(at + 3));
    frames[2].assign(begin, begin + count);
    coordinator->say(peer, decode_message(frames));
    at += kHeader + static_cast<std::size_t>(count);
  }
  coordinator->end_turn();
  return 0;
}
