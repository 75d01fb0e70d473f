#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "coordinator/schedule/reasons.h"
#include "tests/unit/schedule/farm.h"

namespace baton::testing_farm {

/// A farm where everything goes wrong at random: workers vanish, fail, report late or twice,
/// messages are lost, blobs and frames vanish, the coordinator restarts from what it recorded.
/// Workers publish their outputs some time before they report them; states that they may hold they
/// mostly do, until they are asked for them, leave or die. Checks after every step what
/// must hold whatever happens.
class ChaosFarm {
 public:
  struct Options {
    /// Films of many tasks have the same bytes, and so are one blob.
    bool alike = false;
    int num_workers = 5;
    /// Attempts fail, files vanish; else only workers and messages do.
    bool failures = true;
    std::uint64_t store_limit = 0;
    bool restarts = true;  ///< of the coordinator
    /// Of the workers, in turn; where there are several, no bytes of one are those of another, and
    /// each frame is by one.
    int num_renderers = 1;
  };
  ChaosFarm(std::uint32_t seed, JobSpec spec, Options options)
      : random_(seed), spec_(std::move(spec)), graph_(spec_), options_(options) {
    job_ = digest_of("job");
    start_coordinator();
  }

  /// One random thing happens. `trouble`: whether bad things may happen.
  void advance(bool trouble);

  /// A job of the same picture takes the place of this one, ended or not, with other frames, tiles
  /// or runs. It begins with all that the service would leave to it.
  void change_job(JobSpec next);

  void resume() { step(JobResumed{job_}); }

  /// While the job is not done there is a chain of reasons, which names nobody who has left; and
  /// without its last cause the job goes on. The farm stays as it is. Returns the last cause.
  std::optional<ReasonKind> check_reasons() const;

  /// Nothing that it made is left then.
  void delete_job();
  /// Of tasks that are done, blobs that are still in the store.
  std::size_t num_left() const {
    std::set<Digest> left;
    for (const Completion& done : completions_) {
      for (const BlobRef& blob : done.made.outputs) {
        if (blob.kind == BlobKind::state && store_.contains(blob.digest)) left.insert(blob.digest);
      }
    }
    return left.size();
  }

  JobStatus status() const { return scheduler_->find_job(job_)->status; }
  JobProgress progress() const { return scheduler_->find_job(job_)->tasks.progress(); }
  std::size_t num_recorded() const { return completions_.size(); }
  std::size_t num_tasks() const { return static_cast<std::size_t>(graph_.num_tasks()); }
  /// Blobs that were removed from the store, all told.
  std::size_t num_removed() const { return num_removed_; }
  std::size_t num_missing() const { return num_missing_; }
  std::size_t num_failures() const { return failures_.size(); }
  std::size_t num_lost() const { return num_lost_; }
  std::size_t num_reopened() const { return num_reopened_; }
  std::size_t num_events() const { return num_events_; }
  /// States that were held, that a worker published, and that went with it.
  std::size_t num_held() const { return num_held_; }
  std::size_t num_published() const { return num_published_; }
  std::size_t num_held_lost() const { return num_held_lost_; }
  std::size_t num_kept_frames() const { return num_kept_frames_; }
  bool has_all_frames() const { return lost_frames_.empty(); }
  /// Frames that were missed when all tasks were done.
  std::size_t num_inspected_lost() const { return num_inspected_lost_; }
  std::size_t num_cuts() const { return num_cuts_; }
  std::size_t num_taken_over() const { return num_taken_over_; }
  const JobSpec& spec() const { return spec_; }
  /// Bytes of blobs that somebody needs, at most so far.
  std::uint64_t most_bytes() const { return most_bytes_; }

 private:
  struct Held {
    std::vector<BlobRef> inputs;
    StepSpan steps;
    bool holds = false;  ///< the state that it makes
    bool published = false;
  };
  /// A held state, and the blob that it becomes.
  using Memory = std::map<Digest, PublishedState>;

  int roll(int sides) { return static_cast<int>(random_() % static_cast<std::uint32_t>(sides)); }

  void start_coordinator() {
    scheduler_ = std::make_unique<Scheduler>(
        Scheduler::Rules{++epoch_, kSilence, options_.store_limit, options_.num_renderers > 1});
    known_.clear();
    granted_.clear();
    unreported_.merge(told_);
    told_.clear();
    add_job();
  }

  void add_job();

  /// What the job leaves to later ones.
  void keep_blobs() {
    const JobTasks& tasks = scheduler_->find_job(job_)->tasks;
    for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) {
      for (const BlobRef& blob : tasks.ledger().live_blobs(tasks.view(), task))
        kept_.insert(blob.digest);
      for (const BlobRef& blob : tasks.ledger().spare_blobs(tasks.view(), task))
        kept_.insert(blob.digest);
      if (!tasks.ledger().is_cut(task)) continue;
      for (const BlobRef& blob : tasks.ledger().inputs(tasks.view(), task))
        kept_.insert(blob.digest);
    }
  }

  /// A blob that somebody counts on, or a finished frame, which a restart notices.
  void lose_a_file() {
    if (roll(3) == 0 && !completions_.empty()) {
      const Completion& any =
          completions_[static_cast<std::size_t>(roll(static_cast<int>(completions_.size())))];
      if (any.task.kind == TaskKind::assemble) lost_frames_.insert(any.task);
    } else if (!store_.empty()) {
      const auto blob = std::next(store_.begin(), roll(static_cast<int>(store_.size())));
      lost_.insert(*blob);
      store_.erase(blob);
      ++num_lost_;
    }
  }

  void join(const std::string& worker) {
    known_.insert(worker);
    step(WorkerJoined{worker, leases(worker), renderer_of(worker)});
  }

  std::string renderer_of(const std::string& worker) const {
    if (options_.num_renderers == 1) return {};
    return "renderer " + std::to_string(std::stoi(worker.substr(1)) % options_.num_renderers);
  }

  /// The process dies, with all that it holds.
  void end_process(const std::string& worker) {
    num_held_lost_ += memory_[worker].size();
    drop_leases(worker);
    for (const auto& [unused, left] : std::exchange(left_, {}))
      unreported_.insert(left.blobs.begin(), left.blobs.end());
    memory_[worker].clear();
    wanted_.erase(worker);
    known_.erase(worker);
    // What comes next under this name is another process; nobody listens to the old one's socket.
    std::erase_if(old_reports_, [&](const TaskCompleted& done) { return done.worker == worker; });
  }
  /// It has no result of the lease, and will say what it published for it.
  void tell_left(const std::string& worker, const LeaseId& lease, const Held& held) {
    if (held.published)
      left_.push_back({worker, {lease, stored_blobs(outputs(worker, lease.task, held))}});
  }
  void tell_left(const std::string& worker, const LeaseId& lease, const Event& report) {
    if (const auto* done = std::get_if<TaskCompleted>(&report))
      left_.push_back({worker, {lease, stored_blobs(done->made.outputs)}});
  }
  void drop_leases(const std::string& worker) {
    for (const auto& [lease, held] : held_[worker]) tell_left(worker, lease, held);
    for (const auto& [lease, report] : unconfirmed_[worker]) tell_left(worker, lease, report);
    held_[worker].clear();
    unconfirmed_[worker].clear();
  }
  /// Now and then it is lost, or nobody knows the worker: then only the sweep will find them.
  void deliver_left() {
    for (const auto& [worker, left] : std::exchange(left_, {})) {
      if (roll(10) == 0 || !known_.contains(worker)) {
        unreported_.insert(left.blobs.begin(), left.blobs.end());
      } else {
        told_.insert(left.blobs.begin(), left.blobs.end());
        step(left);
      }
    }
  }
  /// It is drained: what it has not begun goes back, what it holds into the store.
  void leave(const std::string& worker) {
    if (!known_.contains(worker)) return;
    HeldPublished all{worker, job_, {}};
    for (const auto& [name, state] : memory_[worker]) all.states.push_back(state);
    publish(all);
    end_process(worker);
    step(WorkerLeft{worker});
  }
  void publish(const HeldPublished& event) {
    for (const PublishedState& state : event.states) store_.insert(state.published.digest);
    num_published_ += event.states.size();
    step(event);
  }

  void ask(const std::string& worker) {
    if (!known_.contains(worker)) join(worker);
    step(WorkRequested{worker, 1 + roll(3)});
  }

  void heartbeat(const std::string& worker);

  void report(const std::string& worker);

  /// A report, which is repeated until it is confirmed: now and then it is lost, now and then the
  /// answer.
  void say(const std::string& worker, const LeaseId& lease, const Event& report) {
    unconfirmed_[worker].insert_or_assign(lease, report);
    if (roll(10) == 0) return;
    if (const auto* done = std::get_if<TaskCompleted>(&report)) {
      receive(*done);
    } else if (const auto* lost = std::get_if<InputsLost>(&report)) {
      receive(*lost);
    } else {
      step(report);
    }
    if (roll(10) > 0) unconfirmed_[worker].erase(lease);
  }
  void repeat(const std::string& worker) {
    if (!known_.contains(worker)) return;
    for (const auto& [lease, report] : std::map(unconfirmed_[worker])) say(worker, lease, report);
  }

  /// What the service makes of a report: what is accepted must be in the store.
  void receive(const TaskCompleted& done) {
    const bool is_missing = !recorded_.contains(done.lease.task) &&
                            std::any_of(done.made.outputs.begin(), done.made.outputs.end(),
                                        [this](const BlobRef& blob) {
                                          return blob.kind != BlobKind::image && !blob.is_held() &&
                                                 !store_.contains(blob.digest);
                                        });
    num_missing_ += is_missing ? 1 : 0;
    reporter_ = done.worker;
    if (is_missing) {
      step(ResultMissing{done.worker, done.lease, done.made.outputs});
    } else {
      step(done);
    }
  }

  /// The service looks itself: what was gone may have been made again since. (It calls that a
  /// failed attempt. Here the worker looks again.)
  void receive(InputsLost lost) {
    std::erase_if(lost.inputs,
                  [this](const BlobRef& blob) { return store_.contains(blob.digest); });
    if (lost.inputs.empty()) {
      step(LeaseReturned{lost.worker, lost.lease, {}});
    } else {
      step(lost);
    }
  }

  /// The worker's next task is rendered; its report is still to come.
  void publish(const std::string& worker) {
    for (auto& [lease, held] : held_[worker]) {
      if (held.published || !missing_inputs(worker, held).empty()) continue;
      held.published = true;
      publish(worker, lease, held);
      return;
    }
  }
  std::vector<BlobRef> missing_inputs(const std::string& worker, const Held& held) {
    std::vector<BlobRef> missing;
    for (const BlobRef& input : held.inputs) {
      const bool is_there =
          input.is_held() ? memory_[worker].contains(input.digest) : store_.contains(input.digest);
      if (!is_there) missing.push_back(input);
    }
    return missing;
  }
  void publish(const std::string& worker, const LeaseId& lease, Held held) {
    const std::vector<BlobRef> made = outputs(worker, lease.task, held);
    held.holds = false;
    const std::vector<BlobRef> packed = outputs(worker, lease.task, held);
    for (std::size_t i = 0; i < made.size(); ++i) {
      if (made[i].is_held()) {
        memory_[worker].insert_or_assign(made[i].digest, PublishedState{made[i], packed[i]});
        ++num_held_;
      } else if (made[i].kind != BlobKind::image) {
        store_.insert(made[i].digest);
      }
    }
  }

  std::vector<BlobRef> outputs(const std::string& worker, const TaskKey& task,
                               const Held& held) const {
    const Digest tiling =
        digest_of("tiles of " + std::to_string(spec_.image.tile_size) + renderer_of(worker));
    std::vector<BlobRef> outputs = outputs_of_grant(spec_, tiling, task, held.steps);
    for (BlobRef& blob : outputs) {
      if (options_.alike && blob.kind == BlobKind::film)
        blob.digest = digest_of("empty tile " + std::to_string((blob.position + blob.tile) / 2));
      if (held.holds && blob.kind == BlobKind::state) {
        blob.digest = held_state_name(job_, blob.step(), blob.tile);
        blob.size_bytes = 0;
      }
    }
    return outputs;
  }

  void fail(const std::string& worker) {
    if (held_[worker].empty() || !known_.contains(worker)) return;
    const LeaseId lease = held_[worker].begin()->first;
    tell_left(worker, lease, held_[worker].begin()->second);
    held_[worker].erase(lease);
    say(worker, lease, AttemptFailed{{lease, worker, "boom"}});
  }

  std::vector<LeaseId> leases(const std::string& worker) {
    std::vector<LeaseId> result;
    for (const auto& [lease, unused] : held_[worker]) result.push_back(lease);
    for (const auto& [lease, unused] : unconfirmed_[worker]) result.push_back(lease);
    return result;
  }

  void step(const Event& event) {
    ++num_events_;
    for (const Action& action : scheduler_->step(event, now_)) {
      std::visit([this](const auto& a) { on(a); }, action);
    }
    check_grants();
    most_bytes_ = std::max(most_bytes_, scheduler_->store_bytes());
    if (std::exchange(inspects_, false)) inspect();
  }
  /// What was lost is noticed now, but for a coordinator that restarts before.
  void inspect() {
    if (roll(10) == 0 && options_.restarts) return start_coordinator();
    FramesInspected found{job_};
    for (const TaskKey& frame : std::exchange(lost_frames_, {})) {
      if (recorded_.contains(frame)) found.lost.push_back(frame);
    }
    num_inspected_lost_ += found.lost.size();
    step(found);
  }

  void on(const RecordCompletion& a) {
    EXPECT_TRUE(recorded_.insert(a.completion.task).second) << "a task counts once";
    completions_.push_back(a.completion);
    makers_[a.completion.task].insert(reporter_);
    lost_frames_.erase(a.completion.task);
    check_renderer(a.completion.task);
  }
  /// What it was made of, but for states, was made by who renders as its maker.
  void check_renderer(const TaskKey& task);
  void on(const RecordOutputs& a) {
    EXPECT_TRUE(recorded_.contains(a.task)) << "only what is done lies anywhere";
    for (Completion& done : completions_) {
      if (done.task == a.task) done.made.outputs = a.outputs;
    }
  }
  void on(const AskForStates& a) {
    for (const Digest& state : a.states)
      EXPECT_TRUE(scheduler_->is_referenced(state)) << "asked for a state that nobody needs";
    if (roll(20) > 0) wanted_[a.worker].insert(a.states.begin(), a.states.end());
  }
  void on(const RecordReopened& a) {
    for (const TaskKey& task : a.tasks) {
      EXPECT_EQ(recorded_.erase(task), 1u) << "only what was done is done again";
      std::erase_if(completions_, [&](const Completion& c) { return c.task == task; });
      rendered_by_.erase(task);
    }
    num_reopened_ += a.tasks.size();
    check_own_loss(a);
  }
  void check_own_loss(const RecordReopened& a) const;
  void on(const RecordFailure& a) { failures_.push_back(a.failure); }
  void on(const RecordJobStatus&) {}
  void on(const RecordRenderer& a) {
    num_taken_over_ += renderer_.empty() ? 0 : 1;
    renderer_ = a.renderer;
  }
  void on(const InspectFrames&) { inspects_ = true; }
  void on(const GrantLease& a);
  void on(const TellLeaseEnd& a) {
    EXPECT_EQ(granted_.erase(a.lease), 1u) << "an end of what was not told to have begun";
  }
  void on(const TellLeaseTaken& a) { EXPECT_TRUE(granted_.insert(a.lease).second); }
  /// Every grant of this coordinator has an end that was told, unless somebody has it.
  void check_grants() const {
    std::set<LeaseId> leased;
    for (const std::string& worker : scheduler_->leases().connected()) {
      for (const LeaseBook::Place& place : scheduler_->leases().of_worker(worker))
        leased.insert(scheduler_->leases().at(place).id);
    }
    EXPECT_TRUE(std::ranges::includes(leased, granted_)) << "a lease ended, and nobody was told";
  }
  void on(const RevokeLease& a) {
    if (const auto held = held_[a.worker].find(a.lease); held != held_[a.worker].end()) {
      tell_left(a.worker, a.lease, held->second);
      held_[a.worker].erase(held);
    }
    if (const auto report = unconfirmed_[a.worker].extract(a.lease))
      tell_left(a.worker, a.lease, report.mapped());
  }
  void on(const ReportNoWork&) {}
  void on(const ForgetWorker& a) { known_.erase(a.worker); }
  void on(const ReportConflict&) { ADD_FAILURE() << "all results are equal here"; }
  void on(const RemoveBlobs& a) {
    for (const Digest& blob : a.blobs) {
      EXPECT_FALSE(scheduler_->is_referenced(blob));
      if (kept_.contains(blob)) continue;
      num_removed_ += store_.erase(blob);
    }
  }

  std::mt19937 random_;
  JobSpec spec_;
  JobGraph graph_;
  Options options_;
  Digest job_;
  TimePoint now_{};
  std::uint32_t epoch_ = 0;
  std::unique_ptr<Scheduler> scheduler_;
  /// Workers that believe the coordinator knows them.
  std::set<std::string> known_;
  std::map<std::string, std::map<LeaseId, Held>> held_;  ///< what each worker has in hand
  std::map<std::string, Memory> memory_;                 ///< what each worker holds
  std::map<std::string, std::set<Digest>> wanted_;       ///< of it, what it was asked for
  std::map<std::string, std::map<LeaseId, Event>> unconfirmed_;
  std::vector<TaskCompleted> old_reports_;
  std::vector<Completion> completions_;  ///< the journal
  std::vector<Failure> failures_;
  std::set<TaskKey> recorded_;
  std::string reporter_;                             ///< of the last report
  std::map<TaskKey, std::set<std::string>> makers_;  ///< whose reports were recorded
  std::map<TaskKey, std::string> rendered_by_;
  std::string renderer_;  ///< of the job, as recorded
  std::set<LeaseId> issued_;
  /// By this coordinator, without an end so far.
  std::set<LeaseId> granted_;
  std::set<Digest> store_;                                 ///< the blobs that are there
  std::vector<std::pair<std::string, AttemptLeft>> left_;  ///< still to be said
  std::set<Digest> told_;                                  ///< of, to this coordinator
  /// Published for leases of which nobody will report.
  std::set<Digest> unreported_;
  std::set<Digest> lost_;  ///< what somebody took
  std::set<TaskKey> lost_frames_;
  JobPlan plan_;
  std::set<Digest> kept_;  ///< blobs of jobs before this one
  std::size_t num_changes_ = 0, num_kept_frames_ = 0, num_cuts_ = 0;
  std::size_t num_removed_ = 0, num_missing_ = 0, num_lost_ = 0, num_reopened_ = 0, num_events_ = 0;
  bool inspects_ = false;
  std::size_t num_taken_over_ = 0;
  std::size_t num_inspected_lost_ = 0;
  std::size_t num_held_ = 0, num_published_ = 0, num_held_lost_ = 0;
  std::uint64_t most_bytes_ = 0;
};

}  // namespace baton::testing_farm
