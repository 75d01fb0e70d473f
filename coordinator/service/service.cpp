#include "coordinator/service/service.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "common/base/build.h"
#include "common/base/legible.h"
#include "common/base/limits.h"
#include "common/store/folder_token.h"
#include "coordinator/service/evidence.h"
#include "coordinator/service/file_room.h"
#include "coordinator/service/permissions.h"
#include "coordinator/service/questions.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int kMaxMessagesPerTurn = 1000;
constexpr std::chrono::seconds kFarewell{2};
constexpr std::chrono::milliseconds kTick{250};
/// What comes again is told so often.
constexpr std::chrono::minutes kTellInterval{1};
constexpr std::size_t kMaxTold = 100;
constexpr std::size_t kMaxWorkerName = 256;

/// For these the document of the job that they name is read.
template <class M>
constexpr bool kReadsDocument =
    std::is_same_v<M, LockFrames> || std::is_same_v<M, SetPriority> ||
    std::is_same_v<M, DeleteJob> || std::is_same_v<M, AskRequeue> || std::is_same_v<M, AskPicture>;

/// bad_input: no worker can have so many in hand.
Status check_leases(const std::vector<LeaseId>& running) {
  constexpr std::size_t kMost = limits::kMaxLeasesPerWorker + limits::kMaxUnconfirmedReports;
  if (running.size() <= kMost) return {};
  return Error{ErrorKind::bad_input,
               fmt::format("{} leases in hand, a worker has at most {}", running.size(), kMost)};
}

/// As Scheduler::Job::renderer has it.
std::string renderer_of(const WorkerHello& hello) { return hello.renderer + ", " + hello.build; }

/// What a worker has to say of a job's files, for those who ask for the job.
void keep_notes(FarmCore& farm, const TaskDone& report) {
  constexpr std::size_t kMostNotes = 100;
  if (report.notes.empty() || farm.scheduler.find_job(report.lease.job) == nullptr) return;
  std::vector<std::string>& notes = farm.notes[report.lease.job];
  for (const std::string& note : report.notes) {
    std::string text = note.substr(0, limits::kMaxTextLength);
    if (notes.size() < kMostNotes && std::ranges::find(notes, text) == notes.end())
      notes.push_back(std::move(text));
  }
}

}  // namespace

// ---- the loop -----------------------------------------------------------------------------------

Result<Service> Service::open(const ServiceOptions& options) {
  raise_file_limit();
  std::error_code error;
  fs::create_directories(options.work_dir, error);
  if (error) {
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot create: {}", options.work_dir.string(), error.message())};
  }
  BATON_ASSIGN(Journal journal, Journal::open(options.work_dir / "journal.sqlite"));
  BATON_ASSIGN(BlobStore store, BlobStore::open(options.work_dir / "store"));
  // Workers, and marks of output folders, have it from a coordinator before this one.
  BATON_ASSIGN(const std::optional<std::string> known, journal.store_token());
  BATON_ASSIGN(std::string token,
               make_token(options.work_dir / "store" / "token", known.value_or("")));
  if (known != token) BATON_TRY(journal.record_store_token(token));
  BATON_ASSIGN(Router router, Router::bind(options.listen, options.access));
  Service service(std::make_unique<FarmCore>(options, std::move(router), std::move(journal),
                                             std::move(store), std::move(token)));
  service.waits_ = std::make_unique<FileWaits>(
      options.disk, [farm = service.owned_farm_.get()] { farm->router.wake(); });
  BATON_TRY(service.restore_jobs());
  BATON_TRY(service.farm_.history.happened(FarmEventKind::coordinator_started));
  return service;
}

Status Service::run(const std::atomic<bool>& stop) {
  while (!stop && !stop_requested_) BATON_TRY(turn());
  waits_.reset();
  // What nobody needs goes as far as there is time; the rest is found later.
  const TimePoint end = Clock::now() + kFarewell;
  while (!farm_.garbage.empty() && Clock::now() < end) BATON_TRY(farm_.let_out());
  const std::vector<PeerId> workers = farm_.peers.connections();
  if (stop_requested_) {
    BATON_TRY(send_home());
  } else {
    BATON_TRY(farm_.history.happened(FarmEventKind::coordinator_stopped));
  }
  BATON_TRY(farm_.journal.commit());
  // Who is told to stop the farm sends the workers home; who is merely ended, by a signal, will be
  // started again, and the workers wait for that.
  if (stop_requested_) {
    for (const PeerId& worker : workers) farm_.router.send(worker, Shutdown{});
  }
  return {};
}

/// Ends what workers have and are, before they are told to end.
Status Service::send_home() {
  // Nobody gets what another one leaves.
  for (const WorkerSummary& worker : farm_.peers.summaries())
    BATON_TRY(farm_.step(WorkRequested{worker.worker_id, 0}));
  for (const WorkerSummary& worker : farm_.peers.summaries()) {
    farm_.peers.remove(worker.worker_id);
    BATON_TRY(farm_.step(WorkerLeft{worker.worker_id}));
    BATON_TRY(farm_.history.happened(FarmEventKind::worker_left, worker.worker_id,
                                     "the farm was stopped"));
  }
  return {};
}

Status Service::turn() {
  // Take what has arrived, or wait for the next tick.
  const auto until_tick = std::chrono::ceil<std::chrono::milliseconds>(next_tick_ - Clock::now());
  std::chrono::milliseconds timeout = std::clamp(until_tick, std::chrono::milliseconds(0), kTick);
  if (!farm_.garbage.empty()) timeout = std::chrono::milliseconds(0);
  const auto until = Clock::now() + std::max(timeout, kTick);
  for (int i = 0; i < kMaxMessagesPerTurn && Clock::now() < until; ++i) {
    const std::optional<Incoming> incoming = farm_.router.receive(timeout);
    if (!incoming) break;
    BATON_TRY(handle(*incoming));
    timeout = std::chrono::milliseconds(0);
  }
  return end_turn();
}

Status Service::end_turn() {
  BATON_TRY(handle_read());
  farm_.history.set_actor({});
  start_inspections();
  if (Clock::now() >= next_tick_) {
    next_tick_ = Clock::now() + kTick;
    asked_for_hello_.clear();
    if (const auto refusal = farm_.router.take_refusal()) tell("refused: " + refusal->message);
    const auto keys = farm_.router.read_keys_again();
    if (!keys) tell("keys stay as they were: " + keys.error().message);
    if (keys && *keys) spdlog::info("{}", **keys);
    if (const auto lack = lack_of_descriptors()) tell("nobody else can connect for long: " + *lack);
    BATON_TRY(farm_.step(ClockTicked{}));
    if (Clock::now() >= next_clean_up_) BATON_TRY(clean_up());
    farm_.garbage.retry();
  }

  // First durable, then known to others.
  BATON_TRY(farm_.archive_ended(files_));
  BATON_TRY(farm_.count_kept());
  BATON_TRY(farm_.journal.commit());
  return farm_.let_out();
}

// ---- messages of workers ------------------------------------------------------------------------

Status Service::receive(const PeerId& peer, const WorkerHello& message) {
  if (message.worker_id.empty() || message.worker_id.size() > kMaxWorkerName) {
    return farm_.refuse(peer,
                        {ErrorKind::bad_input,
                         fmt::format("a worker needs a name of at most {} bytes", kMaxWorkerName)});
  }
  for (const std::string* const text : {&message.host, &message.build, &message.renderer}) {
    if (text->size() > limits::kMaxTextLength)
      return farm_.refuse(peer, {ErrorKind::bad_input,
                                 fmt::format("host, build and renderer of a worker have at most {} "
                                             "bytes",
                                             limits::kMaxTextLength)});
  }
  const WorkerHello* const before = farm_.peers.hello_of(farm_.peers.worker_of(peer));
  if (before != nullptr && before->instance != message.instance)
    return farm_.refuse(peer, {ErrorKind::bad_input, "this connection is another worker's"});
  if (const Status few = check_leases(message.running); !few)
    return farm_.refuse(peer, few.error());
  // A worker is the instance that it drew; its name is for people, and others may have it, too.
  WorkerHello hello = message;
  hello.worker_id = farm_.peers.id_for(message);
  const bool is_new = farm_.peers.hello_of(hello.worker_id) == nullptr;
  if (farm_.peers.is_of_another(hello.worker_id, speaker_.name)) {
    tell(fmt::format("refused: '{}' says that it is worker {}, which has another key",
                     speaker_.name, hello.worker_id));
    return farm_.refuse(peer, {ErrorKind::usage, "this worker is connected with another key"});
  }
  if (is_new && farm_.peers.num_workers() >= limits::kMaxWorkers) {
    return farm_.refuse(peer, {ErrorKind::timeout, fmt::format("the farm is full: {} workers",
                                                               farm_.peers.num_workers())});
  }
  if (const auto lack = is_new ? lack_of_descriptors() : std::nullopt) {
    farm_.peers.turn_away(hello, "the farm is full: " + *lack, Clock::now());
    tell("workers are refused: " + *lack);
    return farm_.refuse(peer, {ErrorKind::timeout, "the farm is full: " + *lack});
  }
  if (const std::optional<std::string> difference = other_build(hello)) {
    if (!farm_.options.mixed_builds) return turn_away(peer, hello, *difference);
    if (is_new) spdlog::warn("{}: results may differ", *difference);
  }

  // Answer before the leases that follow from it.
  farm_.keep_token();
  farm_.peers.add(peer, hello, speaker_.name);
  if (is_new)
    spdlog::info("worker {} joined: {} threads on {}", hello.worker_id, hello.num_threads,
                 hello.host);
  BATON_TRY(
      farm_.reply(peer, WorkerWelcome{farm_.journal.epoch(),
                                      static_cast<std::int32_t>(farm_.options.heartbeat.count()),
                                      farm_.store_directory.string(), farm_.token}));
  // A process that has only become impatient may not have received yet what it was granted.
  if (!is_new) return farm_.step(WorkerAlive{hello.worker_id, hello.running});
  BATON_TRY(
      farm_.history.happened(FarmEventKind::worker_joined, hello.worker_id, worker_text(hello)));
  return farm_.step(WorkerJoined{hello.worker_id, hello.running, renderer_of(hello)});
}

/// Those that are connected may yet turn out to be silent, and the worker asks again: not once they
/// have shown themselves for longer than that takes since it first asked.
Status Service::turn_away(const PeerId& peer, const WorkerHello& hello,
                          const std::string& difference) {
  const TimePoint now = std::chrono::steady_clock::now();
  const TimePoint first = farm_.peers.turn_away(hello, difference, now);
  if (hello.build == build_identity() && now - first <= farm_.options.silence_limit()) {
    tell("not let in now: " + difference);
    return farm_.refuse(
        peer, {ErrorKind::timeout, difference + "; asked again, since that one may be gone"});
  }
  tell("refused: " + difference);
  return farm_.refuse(peer, {ErrorKind::version,
                             difference + "; pixels may differ: use one build on all machines, or "
                                          "start the coordinator with --mixed-builds"});
}

/// Says where pixels of the worker may differ from those of the others; nullopt: nowhere.
std::optional<std::string> Service::other_build(const WorkerHello& hello) const {
  if (hello.build != build_identity())
    return fmt::format("worker {} is {}, the coordinator {}", hello.worker_id, hello.build,
                       build_identity());
  // Unlike machines do different jobs: who can go on with one that is open is let in.
  const std::vector<Digest> jobs = farm_.scheduler.jobs();
  const bool is_needed = std::ranges::any_of(jobs, [&](const Digest& digest) {
    const Scheduler::Job& job = *farm_.scheduler.find_job(digest);
    return is_open(job.status) && job.renderer == renderer_of(hello);
  });
  if (is_needed) return std::nullopt;
  if (const WorkerHello* const other = farm_.peers.find_other_renderer(hello))
    return fmt::format("worker {} renders with {}, worker {} with {}", hello.worker_id,
                       hello.renderer, other->worker_id, other->renderer);
  return std::nullopt;
}

Status Service::receive_from(const std::string& worker, const LeaseRequest& message) {
  const bool is_held = farm_.history.past().is_held(worker);
  return farm_.step(WorkRequested{worker, is_held ? 0 : message.count});
}

Status Service::receive_from(const std::string& worker, const Heartbeat& message) {
  if (const Status few = check_leases(message.running); !few) {
    const auto peer = farm_.peers.peer_of(worker);
    return peer ? farm_.refuse(*peer, few.error()) : Status();
  }
  farm_.peers.note(worker, message);
  BATON_TRY(farm_.reply_to(worker, Heartbeat{}));
  return farm_.step(WorkerAlive{worker, message.running});
}

Status Service::receive_from(const std::string& worker, const TaskDone& message) {
  // What another machine has written may be seen here a moment later; the report is said again.
  const std::optional<ReportedFrame> frame = find_reported_frame(farm_, message);
  const std::optional<Digest> missing = find_missing_blob(farm_, message);
  const bool is_late = missing && !farm_.garbage.has_removed(*missing);
  BATON_ASSIGN(const bool is_elsewhere, frame ? watch_folder(message.lease.job) : false);
  const bool is_frame_there = !frame || (frame->stamp && *frame->stamp);
  if ((is_late || !is_frame_there) && !is_elsewhere && await_outputs(message)) return {};
  late_.erase(message.lease);
  // Leaves after what follows is durable.
  BATON_TRY(farm_.reply_to(worker, ReportReceived{message.lease}));
  // Accepted results must be there: a blob may have gone between publishing and reporting. A frame
  // that is not where it belongs is on a disk that only the worker sees, or in another folder.
  if (is_elsewhere) return farm_.step(ResultMissing{worker, message.lease, message.made.outputs});
  if (!is_frame_there) {
    // Nobody's failure; that of a folder that only the worker sees pauses the job after some times.
    spdlog::warn("worker {}: {}; it is made again", worker,
                 frame->stamp ? frame->path.string() +
                                    ": reported, but gone, cut or another since, or not "
                                    "where the coordinator sees it"
                              : frame->stamp.error().message);
    return farm_.step(ResultMissing{worker, message.lease, message.made.outputs});
  }
  if (missing) {
    spdlog::warn("worker {}: {}: reported, but not there; the task is done again", worker,
                 farm_.store.path(*missing).string());
    return farm_.step(ResultMissing{worker, message.lease, message.made.outputs});
  }
  keep_notes(farm_, message);
  BATON_TRY(farm_.step(TaskCompleted{worker, message.lease, message.made}));
  return frame ? keep_frame_file(message, *frame) : Status();
}

Status Service::receive_from(const std::string& worker, const TaskFailed& message) {
  // What no worker could write is nobody's failure.
  const std::optional<Hindrance> hindrance =
      message.no_space ? Hindrance{"space"} : find_hindrance(farm_, message.lease);
  if (!hindrance && await_inputs(worker, message)) return {};
  BATON_TRY(farm_.reply_to(worker, ReportReceived{message.lease}));
  if (hindrance) return wait_for_disk(farm_, worker, message.lease, *hindrance, message.message);
  // Inputs that are gone, damaged or cannot be read are nobody's fault: what made them is done
  // again.
  const std::optional<std::vector<BlobRef>> bad = find_bad_inputs(farm_, files_, message.lease);
  for (const BlobRef& input : bad.value_or(std::vector<BlobRef>())) {
    spdlog::warn("job {}: {} is gone, damaged or unreadable and is made again",
                 farm_.history.name_of(message.lease.job), farm_.store.path(input.digest).string());
    if (const Status removed = farm_.store.remove(input.digest); !removed)
      spdlog::warn("{}", removed.error().message);
  }
  if (bad) return farm_.step(InputsLost{worker, message.lease, *bad});
  return farm_.step(
      AttemptFailed{{message.lease, worker, message.message.substr(0, limits::kMaxTextLength),
                     message.permanent}});
}

Status Service::receive_from(const std::string& worker, const StatesPublished& message) {
  std::vector<PublishedState> states = message.states;
  std::erase_if(states, [this](const PublishedState& state) {
    return !farm_.store.contains(state.published.digest);
  });
  return farm_.step(HeldPublished{worker, message.job, std::move(states)});
}

Status Service::receive_from(const std::string& worker, const LeaseReturn& message) {
  if (!message.not_held.empty()) {
    std::vector<BlobRef> gone = message.not_held;
    std::erase_if(gone, [](const BlobRef& input) { return !input.is_held(); });
    return farm_.step(InputsLost{worker, message.lease, std::move(gone)});
  }
  if (message.in_place != Digest()) return judge_place(worker, message);
  const auto hindrance =
      message.unseen.empty() ? std::nullopt : find_hindrance(farm_, message.lease);
  if (hindrance) return wait_for_disk(farm_, worker, message.lease, *hindrance, message.unseen);
  const std::string unseen = legible_line(message.unseen.substr(0, limits::kMaxTextLength));
  if (!unseen.empty())
    tell(fmt::format("worker {} takes no tasks of job {}: {}", worker,
                     farm_.history.name_of(message.lease.job), unseen));
  if (!unseen.empty()) {
    // What the folder is known by may not have been written: there was no room, or something stood
    // in its place.
    const Result<std::string> marked = farm_.mark_output(message.lease.job);
    if (!marked) return marked.error();
    BATON_ASSIGN(const bool is_elsewhere, watch_folder(message.lease.job));
    if (is_elsewhere) return farm_.step(LeaseReturned{worker, message.lease});
  }
  return farm_.step(LeaseReturned{worker, message.lease, unseen});
}

Status Service::receive_from(const std::string&, const BlobsLeft& message) {
  return farm_.step(AttemptLeft{message.lease, message.blobs});
}

Status Service::receive_from(const std::string& worker, const WorkerGoodbye&) {
  spdlog::info("worker {} left", worker);
  farm_.peers.remove(worker);
  BATON_TRY(farm_.history.happened(FarmEventKind::worker_left, worker));
  return farm_.step(WorkerLeft{worker});
}

// ---- files that must be read before a message can be handled -----------------------------------

/// Handles what need not wait any more; who waits on is told that it does.
Status Service::handle_read() {
  const TimePoint now = std::chrono::steady_clock::now();
  for (const Incoming& message : waits_->take_ready(files_, now)) BATON_TRY(handle(message));
  for (const FilesRead& read : waits_->take_inspected()) BATON_TRY(end_inspection(read));
  files_.forget_unread();
  for (const FileWaits::Notice& notice : waits_->take_notices(std::chrono::steady_clock::now()))
    BATON_TRY(farm_.refuse(notice.peer, {ErrorKind::timeout, notice.text}));
  return {};
}

/// Whether a report of a failure waits: inputs of its task must be read before anybody is blamed.
/// One for which there is no place is forgotten: the worker repeats it.
bool Service::await_inputs(const std::string& worker, const TaskFailed& message) {
  const auto peer = farm_.peers.peer_of(worker);
  const TimePoint now = std::chrono::steady_clock::now();
  const Incoming incoming{peer.value_or(PeerId()), Message(message), speaker_};
  if (waits_->join(message.lease, incoming, now)) return true;
  std::vector<FileToRead> unread = unread_inputs(farm_, files_, message.lease);
  if (unread.empty()) return false;
  waits_->start(message.lease, {}, std::move(unread), incoming, now);
  return true;
}

/// Whether a message waits for documents that must be parsed; one for which there is no place is
/// refused for now.
Result<bool> Service::await_documents(const PeerId& peer, const Message& message,
                                      NeededDocuments documents) {
  const auto parsing = waits_->parse({peer, message, speaker_}, std::move(documents),
                                     std::chrono::steady_clock::now());
  if (parsing == FileWaits::Parsing::no_place)
    BATON_TRY(farm_.refuse(peer, {ErrorKind::timeout, "other documents are being read"}));
  return parsing != FileWaits::Parsing::done;
}

/// Whether a message waits for the document of the job that it names.
Result<bool> Service::await_document_of(const PeerId& peer, const Message& message,
                                        const std::string& job) {
  const Result<Digest> version = Questions(farm_).resolve(job);
  if (!version || document_at_hand(*version) != nullptr) return false;
  BATON_ASSIGN(std::optional<std::string> text, farm_.journal.document(*version));
  return text ? await_documents(peer, message, {{}, {std::move(*text)}}) : Result<bool>(false);
}

/// Whether a report waits for its files; not for longer than file_patience.
bool Service::await_outputs(const TaskDone& message) {
  constexpr std::size_t kMostLate = limits::kMaxWorkers;
  const TimePoint now = std::chrono::steady_clock::now();
  if (late_.size() >= kMostLate) late_.clear();
  return now - late_.try_emplace(message.lease, now).first->second < farm_.options.file_patience;
}

// ---- who may do what ----------------------------------------------------------------------------

/// Refuses, and logs, what the speaker may not say.
template <class M>
Status Service::forbid(const PeerId& peer) {
  const std::string text =
      fmt::format("{} '{}' may not {}", role_name(speaker_.role), speaker_.name, kRights<M>.what);
  if (complained_.first(peer)) spdlog::warn("refused: {}", text);
  return farm_.refuse(peer, {ErrorKind::usage, text});
}

Status Service::handle(const Incoming& incoming) {
  const PeerId& peer = incoming.peer;
  if (!incoming.message) {
    if (complained_.first(peer)) spdlog::warn("bad message: {}", incoming.message.error().message);
    return farm_.refuse(peer, incoming.message.error());
  }
  const std::string worker = farm_.peers.worker_of(peer);
  speaker_ = incoming.speaker;
  farm_.history.set_actor(worker.empty() ? speaker_.name : "worker " + worker);
  return std::visit(
      [&](const auto& message) -> Status {
        using M = std::decay_t<decltype(message)>;
        if (may_say<M>(speaker_) == May::no) return forbid<M>(peer);
        if constexpr (kReadsDocument<M>) {
          BATON_ASSIGN(const bool waits, await_document_of(peer, message, message.job));
          if (waits) return {};
        }
        if constexpr (requires { this->receive(peer, message); }) {
          return receive(peer, message);
        } else if constexpr (requires(Questions questions) { questions.answer(peer, message); }) {
          return Questions(farm_).answer(peer, message);
        } else if constexpr (requires { this->receive_from(worker, message); }) {
          if (!worker.empty()) return receive_from(worker, message);
          return asked_for_hello_.first(peer) ? farm_.reply(peer, HelloAgain{}) : Status();
        } else {
          return farm_.refuse(peer,
                              {ErrorKind::bad_input, "this message is not for a coordinator"});
        }
      },
      *incoming.message);
}

/// The job that is meant, if the speaker may change it.
Result<Digest> Service::resolve_own(const std::string& text) {
  BATON_ASSIGN(const Digest job, Questions(farm_).resolve(text));
  if (const Status own = farm_.check_own(speaker_, job); !own) {
    spdlog::warn("refused: {}", own.error().message);
    return own.error();
  }
  return job;
}

/// Logs what may come again and again, as when a stranger tries.
void Service::tell(const std::string& warning) {
  const TimePoint now = std::chrono::steady_clock::now();
  if (told_.size() >= kMaxTold) told_.clear();
  const auto [told, is_new] = told_.try_emplace(warning, now);
  if (!is_new && now - told->second < kTellInterval) return;
  told->second = now;
  spdlog::warn("{}", warning);
}

}  // namespace baton
