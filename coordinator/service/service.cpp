#include "coordinator/service/service.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "common/base/build.h"
#include "common/base/limits.h"
#include "common/store/folder_token.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kSilentHeartbeats = 4;
constexpr int kMaxMessagesPerTurn = 1000;
constexpr std::chrono::milliseconds kTick{250};

/// bad_input: no worker can have so many in hand.
Status check_leases(const std::vector<LeaseId>& running) {
  constexpr std::size_t kMost = limits::kMaxLeasesPerWorker + limits::kMaxUnconfirmedReports;
  if (running.size() <= kMost) return {};
  return Error{ErrorKind::bad_input,
               fmt::format("{} leases in hand, a worker has at most {}", running.size(), kMost)};
}

}  // namespace

// ---- the loop -----------------------------------------------------------------------------------

Result<Service> Service::open(const ServiceOptions& options) {
  std::error_code error;
  fs::create_directories(options.work_dir, error);
  if (error) {
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot create: {}", options.work_dir.string(), error.message())};
  }
  BATON_ASSIGN(Journal journal, Journal::open(options.work_dir / "journal.sqlite"));
  BATON_ASSIGN(BlobStore store, BlobStore::open(options.work_dir / "store"));
  BATON_ASSIGN(std::string token, make_token(options.work_dir / "store" / "token"));
  BATON_ASSIGN(Router router, Router::bind(options.listen, options.access));
  Service service(options, std::move(router), std::move(journal), std::move(store),
                  std::move(token));
  BATON_TRY(service.restore_jobs());
  return service;
}

Service::Service(const ServiceOptions& options, Router router, Journal journal, BlobStore store,
                 std::string token)
    : options_(options),
      store_directory_(fs::absolute(options.work_dir / "store").lexically_normal()),
      token_(std::move(token)),
      router_(std::move(router)),
      journal_(std::move(journal)),
      store_(std::move(store)),
      scheduler_(journal_.epoch(), kSilentHeartbeats * options.heartbeat, options.store_limit) {}

Status Service::run(const std::atomic<bool>& stop) {
  waits_ = std::make_unique<FileWaits>(options_.digest_file, [this] { router_.wake(); });
  while (!stop && !stop_requested_) BATON_TRY(turn());
  waits_.reset();
  // Who is told to stop the farm sends the workers home; who is merely ended, by a signal, will be
  // started again, and the workers wait for that.
  if (stop_requested_) {
    for (const PeerId& worker : peers_.connections()) router_.send(worker, Shutdown{});
  }
  return {};
}

Status Service::turn() {
  // Take what has arrived, or wait for the next tick.
  const auto until_tick = std::chrono::ceil<std::chrono::milliseconds>(next_tick_ - Clock::now());
  std::chrono::milliseconds timeout = std::clamp(until_tick, std::chrono::milliseconds(0), kTick);
  for (int i = 0; i < kMaxMessagesPerTurn; ++i) {
    const std::optional<Incoming> incoming = router_.receive(timeout);
    if (!incoming) break;
    BATON_TRY(handle(*incoming));
    timeout = std::chrono::milliseconds(0);
  }
  BATON_TRY(handle_read());
  if (Clock::now() >= next_tick_) {
    next_tick_ = Clock::now() + kTick;
    asked_for_hello_.clear();
    tell_refusals();
    BATON_TRY(step(ClockTicked{}));
    if (Clock::now() >= next_sweep_) BATON_TRY(sweep());
    garbage_.insert(garbage_.end(), unremoved_.begin(), unremoved_.end());
  }

  // First durable, then known to others.
  BATON_TRY(archive_ended());
  BATON_TRY(count_kept());
  BATON_TRY(journal_.commit());
  return let_out();
}

Status Service::let_out() {
  for (const Outgoing& outgoing : std::exchange(outbox_, {})) {
    if (!router_.send(outgoing.peer, outgoing.message))
      spdlog::debug("a peer is gone or does not read; message dropped");
  }
  for (const Digest& blob : std::exchange(garbage_, {})) {
    BATON_ASSIGN(const bool is_kept, journal_.is_kept(blob));
    const bool stays = is_kept || scheduler_.is_referenced(blob);
    const Status removed = stays ? Status() : store_.remove(blob);
    if (!removed && unremoved_.empty()) spdlog::warn("{}; tried again", removed.error().message);
    if (removed) {
      unremoved_.erase(blob);
    } else {
      unremoved_.insert(blob);
    }
  }
  return {};
}

Status Service::step(const Event& event) {
  for (const Action& action : scheduler_.step(event, Clock::now())) {
    BATON_TRY(std::visit([this](const auto& a) { return perform(a); }, action));
  }
  return {};
}

// ---- messages of workers ------------------------------------------------------------------------

Status Service::receive(const PeerId& peer, const WorkerHello& message) {
  if (message.worker_id.empty() || message.worker_id.size() > limits::kMaxTextLength) {
    return refuse(peer, {ErrorKind::bad_input, "a worker needs a name of at most 4096 bytes"});
  }
  if (const Status few = check_leases(message.running); !few) return refuse(peer, few.error());
  // A worker is the instance that it drew; its name is for people, and others may have it, too.
  WorkerHello hello = message;
  hello.worker_id = peers_.id_for(message);
  const bool is_new = peers_.hello_of(hello.worker_id) == nullptr;
  if (is_new && peers_.num_workers() >= limits::kMaxWorkers) {
    return refuse(
        peer, {ErrorKind::io, fmt::format("the farm is full: {} workers", peers_.num_workers())});
  }
  if (const std::optional<std::string> difference = other_build(hello)) {
    if (!options_.mixed_builds) {
      tell("refused: " + *difference);
      return refuse(peer,
                    {ErrorKind::version,
                     fmt::format("{}; pixels may differ: use one build on all machines, or start "
                                 "the coordinator with --mixed-builds",
                                 *difference)});
    }
    if (is_new) spdlog::warn("{}: results may differ", *difference);
  }

  // Answer before the leases that follow from it.
  peers_.add(peer, hello);
  if (is_new)
    spdlog::info("worker {} joined: {} threads on {}", hello.worker_id, hello.num_threads,
                 hello.host);
  BATON_TRY(reply(
      peer, WorkerWelcome{journal_.epoch(), static_cast<std::int32_t>(options_.heartbeat.count()),
                          store_directory_.string(), token_}));
  // A process that has only become impatient may not have received yet what it was granted.
  if (!is_new) return step(WorkerAlive{hello.worker_id, hello.running});
  return step(WorkerJoined{hello.worker_id, hello.running});
}

/// Says where pixels of the worker may differ from those of the others; nullopt: nowhere.
std::optional<std::string> Service::other_build(const WorkerHello& hello) const {
  if (hello.build != build_identity())
    return fmt::format("worker {} is {}, the coordinator {}", hello.worker_id, hello.build,
                       build_identity());
  if (const WorkerHello* const other = peers_.find_other_renderer(hello))
    return fmt::format("worker {} renders with {}, worker {} with {}", hello.worker_id,
                       hello.renderer, other->worker_id, other->renderer);
  return std::nullopt;
}

Status Service::receive_from(const std::string& worker, const LeaseRequest& message) {
  return step(WorkRequested{worker, message.count});
}

Status Service::receive_from(const std::string& worker, const Heartbeat& message) {
  if (const Status few = check_leases(message.running); !few) {
    const auto peer = peers_.peer_of(worker);
    return peer ? refuse(*peer, few.error()) : Status();
  }
  BATON_TRY(reply_to(worker, Heartbeat{}));
  return step(WorkerAlive{worker, message.running});
}

Status Service::receive_from(const std::string& worker, const TaskDone& message) {
  // Leaves after what follows is durable.
  BATON_TRY(reply_to(worker, ReportReceived{message.lease}));
  // Accepted results must be there: a blob may have gone between publishing and reporting. A frame
  // that is not where it belongs is on a disk that only the worker sees.
  if (const auto missing = find_missing_frame(message)) {
    return step(AttemptFailed{
        worker, message.lease,
        fmt::format("{}: reported, but not there as the coordinator sees it: is the output folder "
                    "mounted where the worker runs?",
                    *missing),
        false});
  }
  if (const auto missing = find_missing_blob(message)) {
    spdlog::warn("worker {}: {}: reported, but not there; the task is done again", worker,
                 *missing);
    return step(ResultMissing{worker, message.lease, message.outputs});
  }
  keep_notes(message);
  return step(TaskCompleted{worker, message.lease, message.outputs, message.stats, message.frames});
}

/// What a worker has to say of a job's files, for those who ask for the job.
void Service::keep_notes(const TaskDone& report) {
  constexpr std::size_t kMostNotes = 100;
  if (report.notes.empty() || scheduler_.find_job(report.lease.job) == nullptr) return;
  std::vector<std::string>& notes = notes_[report.lease.job];
  for (const std::string& note : report.notes) {
    std::string text = note.substr(0, limits::kMaxTextLength);
    if (notes.size() < kMostNotes && std::ranges::find(notes, text) == notes.end())
      notes.push_back(std::move(text));
  }
}

Status Service::receive_from(const std::string& worker, const TaskFailed& message) {
  // A disk that takes nothing, as far as the coordinator sees, takes nothing from other workers.
  const bool read_only = !message.no_space && writes_nowhere(message.lease);
  const bool lacks_space = message.no_space || read_only;
  if (!lacks_space && await_inputs(worker, message)) return {};
  BATON_TRY(reply_to(worker, ReportReceived{message.lease}));
  if (lacks_space) {
    const std::string waits =
        fmt::format("{}: {}", read_only ? "a folder that can be written" : "space",
                    message.message.substr(0, limits::kMaxTextLength));
    spdlog::warn("job {} waits for {}", message.lease.job.short_hex(), waits);
    return step(SpaceLacking{worker, message.lease, waits});
  }
  // Inputs that are gone or damaged are nobody's fault: what made them is done again.
  const std::optional<std::vector<BlobRef>> bad = find_bad_inputs(message.lease);
  for (const BlobRef& input : bad.value_or(std::vector<BlobRef>())) {
    spdlog::warn("job {}: {} is gone or damaged and is made again", message.lease.job.short_hex(),
                 store_.path(input.digest).string());
    if (const Status removed = store_.remove(input.digest); !removed)
      spdlog::warn("{}", removed.error().message);
  }
  if (bad) return step(InputsLost{worker, message.lease, *bad});
  return step(AttemptFailed{worker, message.lease,
                            message.message.substr(0, limits::kMaxTextLength), message.permanent});
}

Status Service::receive_from(const std::string& worker, const StatesPublished& message) {
  std::vector<PublishedState> states = message.states;
  std::erase_if(states, [this](const PublishedState& state) {
    return !store_.contains(state.published.digest);
  });
  return step(HeldPublished{worker, message.job, std::move(states)});
}

Status Service::receive_from(const std::string& worker, const LeaseReturn& message) {
  const std::string unseen = message.unseen.substr(0, limits::kMaxTextLength);
  if (!unseen.empty())
    tell(fmt::format("worker {} takes no tasks of job {}: {}", worker,
                     message.lease.job.short_hex(), unseen));
  return step(LeaseReturned{worker, message.lease, unseen});
}

Status Service::receive_from(const std::string&, const BlobsLeft& message) {
  return step(AttemptLeft{message.lease, message.blobs});
}

Status Service::receive_from(const std::string& worker, const WorkerGoodbye&) {
  spdlog::info("worker {} left", worker);
  peers_.remove(worker);
  return step(WorkerLeft{worker});
}

/// The job of a task that is not done; null: there is none.
const Scheduler::Job* Service::job_of_open_task(const LeaseId& lease) const {
  const Scheduler::Job* job = scheduler_.find_job(lease.job);
  const auto task = job ? job->tasks.graph().find(lease.task) : std::nullopt;
  return task && job->tasks.book().status(*task) != TaskStatus::done ? job : nullptr;
}

std::optional<std::string> Service::find_missing_blob(const TaskDone& report) const {
  // Of a task that was done before the blobs may have served their purpose.
  if (job_of_open_task(report.lease) == nullptr) return std::nullopt;
  for (const BlobRef& output : report.outputs) {
    if (output.kind != BlobKind::image && !output.is_held() && !store_.contains(output.digest))
      return store_.path(output.digest).string();
  }
  return std::nullopt;
}

std::optional<std::string> Service::find_missing_frame(const TaskDone& report) const {
  const Scheduler::Job* job = job_of_open_task(report.lease);
  if (job == nullptr || report.lease.task.kind != TaskKind::assemble) return std::nullopt;
  const fs::path path = frame_path(job->spec, report.lease.task.frame());
  for (const BlobRef& output : report.outputs) {
    std::error_code error;
    if (fs::file_size(path, error) != output.size_bytes || error) return path.string();
  }
  return std::nullopt;
}

/// Whether the file system that a task of an open job writes to is mounted read-only.
bool Service::writes_nowhere(const LeaseId& lease) const {
  const Scheduler::Job* job = job_of_open_task(lease);
  if (job == nullptr) return false;
  const bool is_frame = lease.task.kind == TaskKind::assemble;
  fs::path folder = is_frame ? fs::path(job->spec.output.directory) : store_directory_;
  std::error_code error;
  while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  return ::access(folder.c_str(), W_OK) != 0 && errno == EROFS;
}

/// The blobs that a leased task of an open job reads; none where one is being made again.
std::vector<BlobRef> Service::leased_inputs(const LeaseId& lease) const {
  const Scheduler::Job* job = job_of_open_task(lease);
  if (job == nullptr) return {};
  const TaskIndex task = *job->tasks.graph().find(lease.task);
  const TaskBook& book = job->tasks.book();
  if (book.status(task) != TaskStatus::leased || !book.has_inputs(task)) return {};
  std::vector<BlobRef> inputs = job->tasks.ledger().inputs(job->tasks.view(), task);
  std::erase_if(inputs, [](const BlobRef& input) { return input.is_held(); });
  return inputs;
}

/// The inputs of a leased task that are gone or damaged; none of them where a task that makes them
/// is being done again meanwhile. nullopt: the inputs are sound, or the disk cannot tell now.
std::optional<std::vector<BlobRef>> Service::find_bad_inputs(const LeaseId& lease) {
  std::vector<BlobRef> bad;
  const Scheduler::Job* job = job_of_open_task(lease);
  if (job == nullptr) return std::nullopt;
  const TaskIndex task = *job->tasks.graph().find(lease.task);
  if (job->tasks.book().status(task) != TaskStatus::leased) return std::nullopt;
  if (!job->tasks.book().has_inputs(task)) return bad;
  std::error_code error;
  if (!fs::is_directory(store_directory_, error)) return std::nullopt;
  for (const BlobRef& input : leased_inputs(lease)) {
    const fs::path path = store_.path(input.digest);
    if (files_.holds(path, input) == false) bad.push_back(input);
    files_.forget(path);
  }
  if (bad.empty()) return std::nullopt;
  return bad;
}

// ---- answers ------------------------------------------------------------------------------------

Status Service::reply(const PeerId& peer, Message message) {
  outbox_.push_back({peer, std::move(message)});
  return {};
}

Status Service::reply_to(const std::string& worker, Message message) {
  const auto peer = peers_.peer_of(worker);
  return peer ? reply(*peer, std::move(message)) : Status();
}

Status Service::refuse(const PeerId& peer, const Error& error) {
  return reply(peer, Refused{static_cast<std::uint8_t>(error.kind), error.message});
}

}  // namespace baton
