#include "worker/run/worker.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <future>
#include <list>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <thread>

#include "common/base/build.h"
#include "common/base/file_descriptor.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/base/log.h"
#include "common/base/patiently.h"
#include "common/base/trace.h"
#include "common/image/exr_threads.h"
#include "common/job/plan/sequence.h"
#include "common/job/plan/task_place.h"
#include "common/job/text/job_json.h"
#include "common/math/instruction_set.h"
#include "common/protocol/worker_channel.h"
#include "common/store/folder_token.h"
#include "common/store/worker_logs.h"
#include "worker/pass/render_context.h"
#include "worker/run/crash_handler.h"
#include "worker/run/render_threads.h"
#include "worker/run/renderer.h"
#include "worker/run/replay.h"
#include "worker/run/session.h"
#include "worker/run/task_trace.h"
#include "worker/run/task_watch.h"

namespace baton {
namespace {

/// How long the control thread sleeps when nothing wakes it: bounds how late it sees a signal or a
/// due heartbeat.
constexpr std::chrono::milliseconds kTickInterval{50};

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown-host";
}

std::string name_of_worker(const WorkerOptions& options) {
  return options.worker_id.empty() ? fmt::format("{}-{}", host_name(), ::getpid())
                                   : options.worker_id;
}

WorkerHello identity_of(const WorkerOptions& options) {
  WorkerHello identity;
  identity.host = host_name();
  identity.pid = static_cast<std::int32_t>(::getpid());
  // Host and process id do not tell containers apart.
  std::random_device random;
  identity.instance = std::uint64_t{random()} << 32 | random();
  identity.worker_id = name_of_worker(options);
  identity.num_threads = options.num_threads;
  identity.build = build_identity();
  identity.renderer = describe_renderer();
  return identity;
}

SessionOptions session_options(const WorkerOptions& options, const WorkerHello& identity) {
  std::optional<TimePoint> end_at;
  if (options.end_at) {
    end_at =
        std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::milliseconds>(
                                               *options.end_at - std::chrono::system_clock::now());
  }
  return {identity, options.give_up, end_at, options.idle_exit, options.drain};
}

/// Saves the job where a replay can read it. Returns the command that repeats the task: up to the
/// last frame of its run, or the frame of its second pass. Empty: of an assembly, or a later sweep.
Result<std::string> prepare_replay(const JobSpec& job, const BlobStore& store, const Grant& grant) {
  const Step last = grant.steps.last;
  const bool has_frame = last >= Step(0) && last.index() < job.frames.size();
  if (grant.lease.task.kind == TaskKind::assemble || !has_frame) return std::string();
  const std::filesystem::path path = store.job_file(grant.lease.job);
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    BATON_TRY(write_file_atomic(path, as_bytes_view(to_json(job))));
  return replay_command(path, job.frames[last.index()], grant.lease.task.tile);
}

/// The error with the command, if there is one.
Error with_replay(const Error& error, const std::string& command) {
  if (command.empty() || error.kind == ErrorKind::cancelled || error.kind == ErrorKind::no_space)
    return error;
  return {error.kind, fmt::format("{}\nto replay it alone: {}", error.message, command)};
}

/// Why the job could not be loaded, such as a file that is not there.
Error loading_failed(const QueuedTask& task, const Error& error) {
  const std::optional<JobDocument> document = task.job->document();
  if (!document || error.kind == ErrorKind::cancelled) return error;
  const Result<ParsedJobDocument> parsed = parse_job_document(document->json);
  const Result<std::string> command =
      parsed ? prepare_replay(parsed->job, *task.store, task.grant) : std::string();
  return with_replay(error, command ? *command : std::string());
}

/// Notes that the process had.
class NoteLog {
 public:
  /// Logs each once. Returns those that are new of the job.
  std::vector<std::string> report(const Digest& job, const std::vector<std::string>& notes) {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> fresh;
    for (const std::string& note : notes) {
      if (seen_.insert(note).second) spdlog::warn("{}", note);
      if (of_jobs_.emplace(job, note).second) fresh.push_back(note);
    }
    return fresh;
  }

 private:
  std::mutex mutex_;
  std::set<std::string> seen_;
  std::set<std::pair<Digest, std::string>> of_jobs_;
};

/// What loading a job may take, the wait for its document and for another thread's loading
/// included.
constexpr std::chrono::seconds kLoadPatience{limits::kMaxSecondsToLoad};

/// Executes a task on a render thread. The command that repeats it stands in its error message and,
/// should the process die, in the crash report.
Result<TaskResult> execute_queued(const QueuedTask& task, const std::stop_token& stop,
                                  std::vector<BlobRef>& left, NoteLog& notes, TaskWatch& watch,
                                  TaskSpan& span, const Lend& lend) {
  // The time that a task may take does not include the loading of its job, which has its own.
  LoadedJobPtr loaded;
  {
    const TaskWatch::Mark loading(watch, task.grant.lease,
                                  std::chrono::steady_clock::now() + kLoadPatience);
    Result<LoadedJobPtr> result = task.job->load(stop);
    if (!result) return loading_failed(task, result.error());
    loaded = std::move(result).value();
  }
  span.name(*loaded, task.grant);
  if (!loaded->unseen.empty()) {
    notes.report(loaded->digest, {loaded->unseen});
    return TaskResult{.made = {}, .unseen = loaded->unseen};
  }
  BATON_ASSIGN(const std::string command,
               prepare_replay(loaded->context->job, *task.store, task.grant));
  const TaskWatch::Mark mark(
      watch, task.grant.lease,
      std::chrono::steady_clock::now() + std::chrono::seconds(loaded->job.max_seconds_per_task),
      command);
  const TaskKey& key = task.grant.lease.task;
  // Again for each frame: links may have changed.
  BATON_TRY(check_output_root(loaded->job, loaded->roots));
  if (key.kind == TaskKind::assemble) {
    // So may what is mounted.
    if (const Status seen = expect_output_folder(*loaded, stop); !seen) {
      notes.report(loaded->digest, {seen.error().message});
      return TaskResult{.made = {}, .unseen = seen.error().message};
    }
    Result<TaskResult> frame = execute_task(*loaded, *task.store, task.grant, stop, &left, lend);
    if (const Status seen = frame ? Status() : expect_output_folder(*loaded, stop); !seen)
      return TaskResult{.made = {}, .unseen = seen.error().message};
    if (frame) frame->notes = notes.report(loaded->digest, frame->notes);
    return frame;
  }

  const CrashNote note(command);
  Result<TaskResult> output = execute_task(*loaded, *task.store, task.grant, stop, &left);
  if (output) output->notes = notes.report(loaded->digest, asset_notes(*loaded->context, key));
  if (output) return output;
  return with_replay(output.error(), command);
}

/// What waiting for the disk may take; after it the tasks count as failed.
constexpr std::chrono::seconds kDiskPatience{300};

/// Makes the checkpoints among what the tasks made durable. What lies between is made again from
/// them, should the machine lose it; an assembled frame is durable already.
Status publish_queued(std::span<const QueuedTask> tasks, TaskWatch& watch) {
  const auto deadline = std::chrono::steady_clock::now() + kDiskPatience;
  std::list<TaskWatch::Mark> marks;
  std::set<std::shared_ptr<BlobStore>> stores;
  for (const QueuedTask& task : tasks) {
    const TaskKey& key = task.grant.lease.task;
    BATON_ASSIGN(const LoadedJobPtr loaded, task.job->load({}));
    if (key.kind != TaskKind::render || !ends_in_checkpoint(loaded->job, key.run())) continue;
    marks.emplace_back(watch, task.grant.lease, deadline);
    stores.insert(task.store);
  }
  const auto begin = std::chrono::steady_clock::now();
  for (const auto& store : stores) BATON_TRY(store->sync());
  const auto end = std::chrono::steady_clock::now();
  for (const QueuedTask& task : tasks)
    record_span(SpanKind::publish, "publish", begin, end, traced_task(task.grant.lease));
  return {};
}

/// Packs held states of jobs into the store, beside the render threads.
std::vector<StatesPublished> pack_held(const std::vector<std::pair<Digest, JobStates::List>>& jobs,
                                       BlobStore& store) {
  std::vector<StatesPublished> messages;
  for (const auto& [job, states] : jobs) {
    Result<std::vector<PublishedState>> published = publish_held(states, store);
    if (published) {
      messages.push_back({job, std::move(published).value()});
    } else {
      spdlog::warn("states stay unpublished: {}", published.error().message);
    }
  }
  return messages;
}

/// Carries the session's actions out and feeds it with events.
class Worker {
 public:
  Worker(WorkerChannel channel, const WorkerOptions& options)
      : channel_(std::move(channel)),
        identity_(identity_of(options)),
        session_(session_options(options, identity_), now()),
        machine_(options.machine),
        jobs_(
            [this](const JobDocument& document) {
              return load_job_document(document, machine_, shelf_);
            },
            machine_.memory.states, kFilePatience, machine_.memory.scene_bytes / 2),
        exr_threads_(lend_),
        threads_(
            options.num_threads,
            [this](const QueuedTask& task, const std::stop_token& stop,
                   std::vector<BlobRef>& left) {
              TaskSpan span(task.grant);
              Result<TaskResult> result =
                  execute_queued(task, stop, left, notes_, watch_, span, lend_);
              span.end(result);
              return result;
            },
            [this](std::span<const QueuedTask> tasks) { return publish_queued(tasks, watch_); },
            [this] { channel_.wake(); }) {}

  ExitCode run(const std::atomic<int>& signals) {
    int heeded = 0;
    while (!leave_) {
      // Results first: they free slots that the tick then asks leases for.
      for (const LeaseId& lease : threads_.take_executed()) step(TaskExecuted{lease});
      for (TaskEnded& ended : threads_.collect()) {
        log_end(ended);
        step(std::move(ended));
      }
      take_packed();
      end_overdue_tasks();
      heed_refusals();
      if (signals > heeded) {
        if (heeded++ == 0) {
          step(DrainRequested{});
        } else {
          step(GiveBackRequested{});
        }
      }
      step(Tick{});
      if (leave_) break;

      // Sleep until a message, a result, a signal or the next tick; then take all that has come.
      std::optional<Message> message = channel_.receive(kTickInterval);
      while (message && !leave_) {
        step(MessageArrived{std::move(*message)});
        message = channel_.receive(std::chrono::milliseconds(0));
      }
    }
    // The render threads are joined next. One that does not stop must not keep the process alive.
    ::alarm(static_cast<unsigned>(TaskWatch::kStopPatience.count()));
    if (leave_->code == ExitCode::ok) {
      spdlog::info("ends: {}", leave_->reason);
    } else {
      spdlog::error("ends: {}", leave_->reason);
    }
    return leave_->code;
  }

 private:
  static TimePoint now() { return std::chrono::steady_clock::now(); }

  /// Reports tasks that take too long as failed and asks them to stop. One that does not would keep
  /// its thread for ever: nothing but the end of the process frees it.
  void end_overdue_tasks() {
    for (const TaskWatch::Overdue& task : watch_.take_overdue(now())) {
      threads_.stop(task.lease);
      TaskEnded ended{task.lease,
                      with_replay({ErrorKind::timeout,
                                   "ran for longer than maxSecondsPerTask, or loaded its job for a "
                                   "quarter of an hour"},
                                  task.replay)};
      log_end(ended);
      step(std::move(ended));
    }
    if (!watch_.is_stuck(now())) return;
    spdlog::critical("ends: a task has not stopped {} s after its time was up",
                     TaskWatch::kStopPatience.count());
    std::_Exit(static_cast<int>(ExitCode::failed));
  }

  /// Hands over what has been packed since the last turn.
  void take_packed() {
    for (auto packing = packing_.begin(); packing != packing_.end();) {
      if (packing->wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
        ++packing;
        continue;
      }
      HeldPacked packed{packing->get()};
      packing = packing_.erase(packing);
      step(packed);
    }
  }

  /// A key that the coordinator does not know will not be known soon; what else broke a connection
  /// off may pass.
  void heed_refusals() {
    const std::optional<Error> refusal = channel_.take_refusal();
    if (!refusal) return;
    if (refusal->kind == ErrorKind::usage) {
      leave_ = Leave{exit_code_of(refusal->kind), refusal->message};
    } else {
      notes_.report({}, {refusal->message});
    }
  }

  void step(const SessionEvent& event) {
    for (SessionAction& action : session_.step(event, now())) {
      if (leave_) return;
      std::visit([this](auto& a) { perform(a); }, action);
    }
  }

  void perform(SendMessage& action) {
    if (auto* const beat = std::get_if<Heartbeat>(&action.message))
      beat->memory_bytes = resident_bytes();
    if (!channel_.send(action.message)) spdlog::warn("the queue to the coordinator is full");
  }
  void perform(UseStore& action) {
    if (store_ && store_directory_ == action.directory) return;
    const std::filesystem::path folder = map_path(action.directory, machine_.maps);
    Patience patience;
    const Status seen = expect_token(folder / "token", action.token, &patience);
    Result<BlobStore> store =
        seen ? patiently([&] { return BlobStore::open(folder); }, patience) : seen.error();
    if (!store) {
      channel_.send(WorkerGoodbye{});
      leave_ = Leave{exit_code_of(store.error().kind), store.error().message};
      return;
    }
    store_directory_ = action.directory;
    store_ = std::make_shared<BlobStore>(std::move(store).value());
    if (!std::exchange(logs_to_file_, true)) {
      const std::filesystem::path file = own_log(folder.parent_path());
      if (const Status opened = log_to_file(file); !opened)
        spdlog::warn("no log for `baton job log`: {}", opened.error().message);
      if (const Status opened = trace_to_file(trace_beside(file), identity_.worker_id); !opened)
        spdlog::warn("no trace for `baton job trace`: {}", opened.error().message);
    }
    spdlog::info("the coordinator has answered, blobs are in {}", folder.string());
  }
  /// The log of its name; where another process writes that, one of its own, named as the
  /// coordinator tells the two apart.
  std::filesystem::path own_log(const std::filesystem::path& work_folder) {
    const std::filesystem::path file = worker_log(work_folder, identity_.worker_id);
    std::error_code error;
    std::filesystem::create_directories(file.parent_path(), error);
    auto lock = try_lock_file(file.parent_path() / ("." + file.stem().string() + ".lock"));
    if (lock && !*lock) return worker_log(work_folder, identity_.own_name());
    if (lock) log_lock_ = std::move(*lock);
    return file;
  }
  void perform(StartTask& action) {
    std::shared_ptr<JobEntry> job = jobs_.entry(action.grant.lease.job);
    const bool missing = !job->document();
    if (steps_.size() >= limits::kMaxLeasesPerWorker) steps_.clear();
    steps_[action.grant.lease] = action.grant.steps;
    if (!missing)
      spdlog::debug("job {}: {}: taken", name_of(action.grant.lease.job),
                    place_of_task(action.grant.lease));
    threads_.submit({std::move(action.grant), std::move(job), store_});
    if (missing) step(DocumentMissing{action.grant.lease.job});
  }
  void perform(PackHeld& action) {
    std::vector<std::pair<Digest, JobStates::List>> jobs;
    for (const auto& [job, kept] : jobs_.states()) {
      if (action.request && action.request->job != job) continue;
      JobStates::List states = action.request ? kept->held(action.request->states) : kept->held();
      if (!states.empty()) jobs.emplace_back(job, std::move(states));
    }
    packing_.push_back(
        std::async(std::launch::async, [this, jobs = std::move(jobs), store = store_] {
          std::vector<StatesPublished> messages;
          if (!jobs.empty()) messages = pack_held(jobs, *store);
          channel_.wake();
          return messages;
        }));
  }
  void perform(StopTask& action) { threads_.stop(action.lease); }
  void perform(DropQueuedTasks&) { threads_.drop_queued(); }
  void perform(TakeDocument& action) {
    if (names_.size() >= limits::kMaxJobs) names_.clear();
    names_[action.document.job] = action.document.id.short_hex();
    jobs_.entry(action.document.job)->provide(action.document);
  }
  void perform(Warn& action) { spdlog::warn("{}", action.message); }
  void perform(HangUp&) { channel_.hang_up(); }
  void perform(Leave& action) { leave_ = std::move(action); }

  /// The ID of a job, for people; as long as its document has not come, what is known of that.
  std::string name_of(const Digest& job) const {
    const auto found = names_.find(job);
    return found == names_.end() ? job.short_hex() : found->second;
  }
  void log_end(const TaskEnded& ended) {
    const std::string what =
        fmt::format("job {}: {}", name_of(ended.lease.job), place_of_task(ended.lease));
    if (ended.result) {
      spdlog::debug("{}: done", what);
    } else if (ended.result.error().kind == ErrorKind::cancelled) {
      spdlog::debug("{}: stopped", what);
    } else {
      spdlog::error("{} failed: {}", what, ended.result.error().message);
    }
    steps_.erase(ended.lease);
  }
  /// As the coordinator says it, once the job is loaded.
  std::string place_of_task(const LeaseId& lease) const {
    const std::string attempt = fmt::format(", attempt {}", lease.attempt);
    // Which steps the coordinator's runs have, its grants alone say.
    const auto steps = steps_.find(lease);
    for (const LoadedJobPtr& loaded : jobs_.loaded()) {
      if (loaded->digest == lease.job && steps != steps_.end())
        return place_text(place_of(loaded->job, Timeline(loaded->job), lease.task, steps->second)) +
               attempt;
    }
    return fmt::format("{}, tile {}{}", task_name(lease.task.kind), lease.task.tile, attempt);
  }

  WorkerChannel channel_;
  const WorkerHello identity_;
  Session session_;
  std::optional<FileDescriptor> log_lock_;
  const Machine machine_;
  AssetShelf shelf_;  ///< what jobs_ loads from
  JobCache jobs_;
  std::map<Digest, std::string> names_;  ///< of jobs whose document has come
  std::map<LeaseId, StepSpan> steps_;    ///< of tasks in hand
  std::shared_ptr<BlobStore> store_;
  std::filesystem::path store_directory_;
  bool logs_to_file_ = false;
  std::optional<Leave> leave_;
  NoteLog notes_;
  TaskWatch watch_;
  std::list<std::future<std::vector<StatesPublished>>> packing_;
  const Lend lend_ = [this](auto work) { return threads_.lend(std::move(work)); };
  const ExrThreads exr_threads_;
  /// Last: its threads use the rest and are joined first.
  RenderThreads threads_;
};

}  // namespace

Status use_instruction_set(const std::string& name) { return limit_instruction_set(name); }

std::string describe_worker() {
  return fmt::format("{}\nrenders with {}", build_identity(), describe_renderer());
}

ExitCode run_worker(const WorkerOptions& options, const std::atomic<int>& signals) {
  Result<WorkerChannel> channel = WorkerChannel::connect(options.endpoint, options.access);
  if (!channel) {
    spdlog::error("{}", channel.error().message);
    return exit_code_of(channel.error().kind);
  }
  std::optional<Worker> worker(std::in_place, std::move(channel).value(), options);
  const ExitCode code = worker->run(signals);
  worker.reset();  // ends its threads
  end_trace();
  return code;
}

}  // namespace baton
