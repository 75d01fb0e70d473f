#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <random>

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
    bool alike = false;  ///< films of many tasks have the same bytes, and so are one blob
    int num_workers = 5;
    bool failures = true;  ///< attempts fail, files vanish; else only workers and messages do
  };
  ChaosFarm(std::uint32_t seed, JobSpec spec, Options options)
      : random_(seed), spec_(std::move(spec)), graph_(spec_), options_(options) {
    job_ = digest_of("job");
    start_coordinator();
  }

  /// One random thing happens. `trouble`: whether bad things may happen.
  void advance(bool trouble) {
    now_ += std::chrono::milliseconds(roll(300));
    const std::string worker = "w" + std::to_string(roll(options_.num_workers));
    const int what = roll(100);
    if (what < 30) {
      ask(worker);
    } else if (what < 50) {
      publish(worker);
    } else if (what < 70) {
      report(worker);
    } else if (what < 80) {
      step(ClockTicked{});
    } else if (what < 88) {
      for (int i = 0; i < options_.num_workers; ++i) heartbeat("w" + std::to_string(i));
    } else if (!trouble) {
      return;
    } else if (what < 91) {
      end_process(worker);
      if (roll(2)) join(worker);
    } else if (what < 92) {
      leave(worker);
    } else if (what < 93) {
      now_ += kSilence;
    } else if (what < 96) {
      if (options_.failures) fail(worker);
    } else if (what < 97) {
      start_coordinator();
    } else if (what < 98) {
      if (options_.failures) lose_a_file();
    } else if (!old_reports_.empty()) {
      receive(old_reports_[static_cast<std::size_t>(roll(static_cast<int>(old_reports_.size())))]);
    }
  }

  /// A job of the same picture takes the place of this one, ended or not, with other frames, tiles
  /// or runs. It begins with all that the service would leave to it.
  void change_job(JobSpec next) {
    FormerJob former{document_of(spec_), completions_of(completions_).tasks, plan_,
                     JobStatus::cancelled};
    if (is_open(status())) step(JobSuperseded{job_, {}});
    keep_blobs();
    step(JobForgotten{job_});
    held_.clear();
    memory_.clear();
    wanted_.clear();
    unconfirmed_.clear();
    old_reports_.clear();

    // Frames are files with numbers.
    std::set<int> written;
    for (const Completion& done : completions_) {
      if (done.task.kind == TaskKind::assemble && !lost_frames_.contains(done.task))
        written.insert(spec_.frames[static_cast<std::size_t>(done.task.step)]);
    }
    const KeptFiles files{
        .has_frame =
            [&](std::int32_t frame, const BlobRef&) {
              return written.contains(next.frames[static_cast<std::size_t>(frame)]);
            },
        .has_blob = [&](const BlobRef& blob) { return store_.contains(blob.digest); }};
    const Adoption adoption = adopt(document_of(next), {former}, files);
    num_kept_frames_ += adoption.images.size();
    num_cuts_ += adoption.plan.cuts.size();

    std::vector<Completion> taken;
    const std::set<TaskKey> tasks(adoption.tasks.begin(), adoption.tasks.end());
    for (const Completion& done : completions_) {
      if (tasks.contains(done.task)) taken.push_back(done);
    }
    for (const BlobRef& image : adoption.images)
      taken.push_back({{TaskKind::assemble, image.frame, 0}, {image}, {}, {}});
    for (const TaskKey& task : adoption.settled) taken.push_back({task, {}, {}, {}});
    spec_ = std::move(next);
    spec_.leading_runs = adoption.plan.leading_runs;
    graph_ = JobGraph(spec_);
    plan_ = adoption.plan;
    completions_ = std::move(taken);
    recorded_.clear();
    for (const Completion& done : completions_)
      EXPECT_TRUE(recorded_.insert(done.task).second) << "adopted twice";
    failures_.clear();
    lost_frames_.clear();
    job_ = digest_of("job " + std::to_string(++num_changes_));
    add_job();
    std::erase_if(kept_, [this](const Digest& blob) { return scheduler_->is_referenced(blob); });
  }

  /// Nothing that it made is left then.
  void delete_job() {
    step(JobForgotten{job_});
    for (const Digest& blob : kept_) store_.erase(blob);
    EXPECT_EQ(scheduler_->find_job(job_), nullptr);
    for (const TaskCompleted& late : old_reports_) step(late);
    EXPECT_FALSE(std::any_of(store_.begin(), store_.end(), [this](const Digest& blob) {
      return scheduler_->is_referenced(blob);
    }));
  }
  /// Of tasks that are done, blobs that are still in the store.
  std::size_t num_left() const {
    std::set<Digest> left;
    for (const Completion& done : completions_) {
      for (const BlobRef& blob : done.outputs) {
        if (blob.kind == BlobKind::state && store_.contains(blob.digest)) left.insert(blob.digest);
      }
    }
    return left.size();
  }

  JobStatus status() const { return scheduler_->find_job(job_)->status; }
  const JobProgress& progress() const { return scheduler_->find_job(job_)->tasks.progress(); }
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
  std::size_t num_cuts() const { return num_cuts_; }
  const JobSpec& spec() const { return spec_; }

 private:
  struct Held {
    std::vector<BlobRef> inputs;
    FrameSpan frames;
    bool holds = false;  ///< the state that it makes
    bool published = false;
  };
  /// A held state, and the blob that it becomes.
  using Memory = std::map<Digest, PublishedState>;

  int roll(int sides) { return static_cast<int>(random_() % static_cast<std::uint32_t>(sides)); }

  void start_coordinator() {
    scheduler_ = std::make_unique<Scheduler>(++epoch_, kSilence);
    known_.clear();
    add_job();
  }

  void add_job() {
    JobAdded added{job_, spec_, JobStatus::running, completions_of(completions_), failures_};
    added.plan = plan_;
    // It looks for every file that it counts on.
    Scheduler trial(0, kSilence);
    trial.step(added, now_);
    const JobTasks& tasks = trial.find_job(job_)->tasks;
    for (const Completion& done : completions_) {
      const auto live = tasks.live_blobs(*graph_.find(done.task));
      const bool lost = std::any_of(live.begin(), live.end(), [this](const BlobRef& blob) {
        return !blob.is_held() && !store_.contains(blob.digest);
      });
      if (lost || lost_frames_.erase(done.task) > 0) added.lost.push_back(done.task);
      for (const BlobRef& spare : tasks.spare_blobs(*graph_.find(done.task))) {
        if (!store_.contains(spare.digest)) added.lost_spares.push_back(done.task);
      }
    }
    for (const Cut& cut : plan_.cuts) {
      const bool lost =
          std::any_of(cut.states.begin(), cut.states.end(),
                      [this](const BlobRef& blob) { return !store_.contains(blob.digest); });
      if (lost && tasks.is_cut(*graph_.find(cut.task))) added.lost.push_back(cut.task);
    }
    step(added);
  }

  /// What the job leaves to later ones.
  void keep_blobs() {
    const JobTasks& tasks = scheduler_->find_job(job_)->tasks;
    for (TaskIndex task = 0; task < graph_.num_tasks(); ++task) {
      for (const BlobRef& blob : tasks.live_blobs(task)) kept_.insert(blob.digest);
      for (const BlobRef& blob : tasks.spare_blobs(task)) kept_.insert(blob.digest);
      if (!tasks.is_cut(task)) continue;
      for (const BlobRef& blob : tasks.inputs(task)) kept_.insert(blob.digest);
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
    step(WorkerJoined{worker, leases(worker)});
  }

  /// The process dies, with all that it holds.
  void end_process(const std::string& worker) {
    num_held_lost_ += memory_[worker].size();
    memory_[worker].clear();
    wanted_.erase(worker);
    held_[worker].clear();
    unconfirmed_[worker].clear();
    known_.erase(worker);
    // What comes next under this name is another process; nobody listens to the old one's socket.
    std::erase_if(old_reports_, [&](const TaskCompleted& done) { return done.worker == worker; });
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

  void heartbeat(const std::string& worker) {
    repeat(worker);
    if (!known_.contains(worker)) return;
    step(WorkerAlive{worker, leases(worker)});
    if (const auto asked = wanted_.find(worker); asked != wanted_.end() && roll(4) > 0) {
      HeldPublished some{worker, job_, {}};
      for (const Digest& name : asked->second) {
        if (const auto state = memory_[worker].find(name); state != memory_[worker].end())
          some.states.push_back(state->second);
      }
      wanted_.erase(asked);
      publish(some);
    }
  }

  void report(const std::string& worker) {
    if (held_[worker].empty()) return;
    if (!known_.contains(worker)) join(worker);
    if (held_[worker].empty()) return;
    const auto [lease, held] = *held_[worker].begin();
    const std::vector<BlobRef> unread = missing_inputs(worker, held);
    held_[worker].erase(lease);
    const bool unheld = std::any_of(unread.begin(), unread.end(),
                                    [](const BlobRef& blob) { return blob.is_held(); });
    if (!held.published && unheld) {
      say(worker, lease, AttemptFailed{worker, lease, "is not held here", false});
      return;
    }
    if (!held.published && !unread.empty()) {
      say(worker, lease, InputsLost{worker, lease, unread});
      return;
    }
    if (!held.published) publish(worker, lease, held);
    const TaskCompleted done{worker, lease, outputs(lease.task, held), {}};
    old_reports_.push_back(done);
    say(worker, lease, done);
  }

  /// A report, which is repeated until it is confirmed: now and then it is lost, now and then the
  /// answer.
  void say(const std::string& worker, const LeaseId& lease, const Event& report) {
    unconfirmed_[worker].insert_or_assign(lease, report);
    if (roll(10) == 0) return;
    if (const auto* done = std::get_if<TaskCompleted>(&report)) {
      receive(*done);
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
    const bool is_missing =
        !recorded_.contains(done.lease.task) &&
        std::any_of(done.outputs.begin(), done.outputs.end(), [this](const BlobRef& blob) {
          return blob.kind != BlobKind::image && !blob.is_held() && !store_.contains(blob.digest);
        });
    num_missing_ += is_missing ? 1 : 0;
    if (is_missing) {
      step(ResultMissing{done.worker, done.lease});
    } else {
      step(done);
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
    const std::vector<BlobRef> made = outputs(lease.task, held);
    held.holds = false;
    const std::vector<BlobRef> packed = outputs(lease.task, held);
    for (std::size_t i = 0; i < made.size(); ++i) {
      if (made[i].is_held()) {
        memory_[worker].insert_or_assign(made[i].digest, PublishedState{made[i], packed[i]});
        ++num_held_;
      } else {
        store_.insert(made[i].digest);
      }
    }
  }

  std::vector<BlobRef> outputs(const TaskKey& task, const Held& held) const {
    const Digest tiling = digest_of("tiles of " + std::to_string(spec_.image.tile_size));
    std::vector<BlobRef> outputs = outputs_of_grant(spec_, tiling, task, held.inputs, held.frames);
    for (BlobRef& blob : outputs) {
      if (options_.alike && blob.kind == BlobKind::film)
        blob.digest = digest_of("empty tile " + std::to_string((blob.frame + blob.tile) / 2));
      if (held.holds && blob.kind == BlobKind::state) {
        blob.digest = held_state_name(job_, blob.frame, blob.tile);
        blob.size_bytes = 0;
      }
    }
    return outputs;
  }

  void fail(const std::string& worker) {
    if (held_[worker].empty() || !known_.contains(worker)) return;
    const LeaseId lease = held_[worker].begin()->first;
    held_[worker].erase(lease);
    say(worker, lease, AttemptFailed{worker, lease, "boom", false});
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
  }

  void on(const RecordCompletion& a) {
    EXPECT_TRUE(recorded_.insert(a.completion.task).second) << "a task counts once";
    completions_.push_back(a.completion);
    lost_frames_.erase(a.completion.task);
  }
  void on(const RecordOutputs& a) {
    EXPECT_TRUE(recorded_.contains(a.task)) << "only what is done lies anywhere";
    for (Completion& done : completions_) {
      if (done.task == a.task) done.outputs = a.outputs;
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
    }
    num_reopened_ += a.tasks.size();
  }
  void on(const RecordFailure& a) { failures_.push_back(a.failure); }
  void on(const RecordJobStatus&) {}
  void on(const GrantLease& a) {
    EXPECT_FALSE(recorded_.contains(a.lease.task)) << "granted after it was done";
    EXPECT_TRUE(issued_.insert(a.lease).second) << "a lease id is used once";
    for (const TaskIndex input : graph_.inputs(a.lease.task)) {
      EXPECT_TRUE(recorded_.contains(graph_.key(input))) << "granted before its input was recorded";
    }
    // Who is not known any more gets no message.
    const bool arrives = roll(20) > 0 && known_.contains(a.worker);
    Memory& memory = memory_[a.worker];
    if (arrives)
      std::erase_if(memory, [&](const auto& s) { return s.second.held.frame < a.states_from; });
    for (const BlobRef& input : a.inputs) {
      EXPECT_TRUE(scheduler_->is_referenced(input.digest));
      if (input.is_held()) {
        EXPECT_TRUE(memory.contains(input.digest) || !known_.contains(a.worker))
            << "granted to a worker that does not hold an input";
      } else {
        EXPECT_TRUE(store_.contains(input.digest) || lost_.contains(input.digest))
            << "granted with an input that was removed";
      }
    }
    if (arrives)
      held_[a.worker].emplace(a.lease, Held{a.inputs, a.frames, a.may_hold && roll(5) > 0});
  }
  void on(const RevokeLease& a) {
    held_[a.worker].erase(a.lease);
    unconfirmed_[a.worker].erase(a.lease);
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
  std::set<std::string> known_;  ///< to the coordinator, as the workers believe
  std::map<std::string, std::map<LeaseId, Held>> held_;  ///< what each worker has in hand
  std::map<std::string, Memory> memory_;                 ///< what each worker holds
  std::map<std::string, std::set<Digest>> wanted_;       ///< of it, what it was asked for
  std::map<std::string, std::map<LeaseId, Event>> unconfirmed_;
  std::vector<TaskCompleted> old_reports_;
  std::vector<Completion> completions_;  ///< the journal
  std::vector<Failure> failures_;
  std::set<TaskKey> recorded_;
  std::set<LeaseId> issued_;
  std::set<Digest> store_;  ///< the blobs that are there
  std::set<Digest> lost_;   ///< that somebody took
  std::set<TaskKey> lost_frames_;
  JobPlan plan_;
  std::set<Digest> kept_;  ///< blobs of jobs before this one
  std::size_t num_changes_ = 0, num_kept_frames_ = 0, num_cuts_ = 0;
  std::size_t num_removed_ = 0, num_missing_ = 0, num_lost_ = 0, num_reopened_ = 0, num_events_ = 0;
  std::size_t num_held_ = 0, num_published_ = 0, num_held_lost_ = 0;
};

}  // namespace baton::testing_farm
