#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;

/// A farm where everything goes wrong at random: workers vanish, fail, report late or twice,
/// messages are lost, blobs and frames vanish, the coordinator restarts from what it recorded.
/// Workers publish their outputs some time before they report them. Checks after every step what
/// must hold whatever happens.
class ChaosFarm {
 public:
  /// alike: films of many tasks have the same bytes, and so are one blob.
  ChaosFarm(std::uint32_t seed, JobSpec spec, bool alike)
      : random_(seed), spec_(std::move(spec)), graph_(spec_), alike_(alike) {
    job_ = digest_of("job");
    start_coordinator();
  }

  /// One random thing happens. `trouble`: whether bad things may happen.
  void advance(bool trouble) {
    now_ += std::chrono::milliseconds(roll(300));
    const std::string worker = "w" + std::to_string(roll(5));
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
      for (int i = 0; i < 5; ++i) heartbeat("w" + std::to_string(i));
    } else if (!trouble) {
      return;
    } else if (what < 91) {
      held_[worker].clear();
      unconfirmed_[worker].clear();
      if (roll(2)) join(worker);
    } else if (what < 93) {
      now_ += kSilence;
    } else if (what < 96) {
      fail(worker);
    } else if (what < 97) {
      start_coordinator();
    } else if (what < 98) {
      lose_a_file();
    } else if (!old_reports_.empty()) {
      receive(old_reports_[static_cast<std::size_t>(roll(static_cast<int>(old_reports_.size())))]);
    }
  }

  /// Nothing that it made is left then.
  void delete_job() {
    step(JobDeleted{job_});
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

 private:
  struct Held {
    std::vector<BlobRef> inputs;
    bool published = false;
  };

  int roll(int sides) { return static_cast<int>(random_() % static_cast<std::uint32_t>(sides)); }

  void start_coordinator() {
    scheduler_ = std::make_unique<Scheduler>(++epoch_, kSilence);
    known_.clear();
    JobAdded added{job_, spec_, JobStatus::running, completions_of(completions_), failures_};
    // It looks for every file that it counts on.
    Scheduler trial(0, kSilence);
    trial.step(added, now_);
    const JobTasks& tasks = trial.find_job(job_)->tasks;
    for (const Completion& done : completions_) {
      const auto live = tasks.live_blobs(*graph_.find(done.task));
      const bool lost = std::any_of(live.begin(), live.end(), [this](const BlobRef& blob) {
        return !store_.contains(blob.digest);
      });
      if (lost || lost_frames_.erase(done.task) > 0) added.lost.push_back(done.task);
      for (const BlobRef& spare : tasks.spare_blobs(*graph_.find(done.task))) {
        if (!store_.contains(spare.digest)) added.lost_spares.push_back(done.task);
      }
    }
    step(added);
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

  void ask(const std::string& worker) {
    if (!known_.contains(worker)) join(worker);
    step(WorkRequested{worker, 1 + roll(3)});
  }

  void heartbeat(const std::string& worker) {
    repeat(worker);
    if (known_.contains(worker)) step(WorkerAlive{worker, leases(worker)});
  }

  void report(const std::string& worker) {
    if (held_[worker].empty()) return;
    if (!known_.contains(worker)) join(worker);
    if (held_[worker].empty()) return;
    const auto [lease, held] = *held_[worker].begin();
    const std::vector<BlobRef> unread = missing_inputs(held);
    held_[worker].erase(lease);
    if (!held.published && !unread.empty()) {
      say(worker, lease, InputsLost{worker, lease, unread});
      return;
    }
    if (!held.published) publish(lease);
    const TaskCompleted done{worker, lease, outputs(lease.task), {}};
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
          return blob.kind != BlobKind::image && !store_.contains(blob.digest);
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
      if (held.published || !missing_inputs(held).empty()) continue;
      held.published = true;
      publish(lease);
      return;
    }
  }
  std::vector<BlobRef> missing_inputs(const Held& held) const {
    std::vector<BlobRef> missing;
    for (const BlobRef& input : held.inputs) {
      if (!store_.contains(input.digest)) missing.push_back(input);
    }
    return missing;
  }
  void publish(const LeaseId& lease) {
    for (const BlobRef& blob : outputs(lease.task)) store_.insert(blob.digest);
  }

  std::vector<BlobRef> outputs(const TaskKey& task) const {
    std::vector<BlobRef> outputs = outputs_of(spec_, job_, task);
    for (BlobRef& blob : outputs) {
      if (alike_ && blob.kind == BlobKind::film)
        blob.digest = digest_of("empty tile " + std::to_string((blob.frame + blob.tile) / 2));
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
  void on(const RecordReopened& a) {
    for (const TaskKey& task : a.tasks) {
      EXPECT_EQ(recorded_.erase(task), 1u) << "only what was done is done again";
      std::erase_if(completions_, [&](const Completion& c) { return c.task == task; });
    }
    num_reopened_ += a.tasks.size();
  }
  void on(const RecordFailure& a) { failures_.push_back(a.failure); }
  void on(const RecordJobStatus&) {}
  void on(const RecordJobDeleted& a) { EXPECT_EQ(a.job, job_); }
  void on(const GrantLease& a) {
    EXPECT_FALSE(recorded_.contains(a.lease.task)) << "granted after it was done";
    EXPECT_TRUE(issued_.insert(a.lease).second) << "a lease id is used once";
    for (const TaskIndex input : graph_.inputs(a.lease.task)) {
      EXPECT_TRUE(recorded_.contains(graph_.key(input))) << "granted before its input was recorded";
    }
    for (const BlobRef& input : a.inputs) {
      EXPECT_TRUE(scheduler_->is_referenced(input.digest));
      EXPECT_TRUE(store_.contains(input.digest) || lost_.contains(input.digest))
          << "granted with an input that was removed";
    }
    // Now and then the message is lost.
    if (roll(20) > 0) held_[a.worker].emplace(a.lease, Held{a.inputs});
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
      num_removed_ += store_.erase(blob);
    }
  }

  std::mt19937 random_;
  JobSpec spec_;
  JobGraph graph_;
  bool alike_;
  Digest job_;
  TimePoint now_{};
  std::uint32_t epoch_ = 0;
  std::unique_ptr<Scheduler> scheduler_;
  std::set<std::string> known_;  ///< to the coordinator, as the workers believe
  std::map<std::string, std::map<LeaseId, Held>> held_;  ///< what each worker has in hand
  std::map<std::string, std::map<LeaseId, Event>> unconfirmed_;
  std::vector<TaskCompleted> old_reports_;
  std::vector<Completion> completions_;  ///< the journal
  std::vector<Failure> failures_;
  std::set<TaskKey> recorded_;
  std::set<LeaseId> issued_;
  std::set<Digest> store_;  ///< the blobs that are there
  std::set<Digest> lost_;   ///< that somebody took
  std::set<TaskKey> lost_frames_;
  std::size_t num_removed_ = 0, num_missing_ = 0, num_lost_ = 0, num_reopened_ = 0, num_events_ = 0;
};

/// 1,000, or as the environment says: 20,000 are some ten million events.
std::uint32_t num_seeds() {
  const char* const text = std::getenv("BATON_MODEL_SEEDS");
  return text != nullptr ? static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10)) : 1000;
}

TEST(SchedulerModel, EveryTaskIsDoneOnceWhateverHappens) {
  std::size_t num_missing = 0, num_lost = 0, num_reopened = 0, num_events = 0, num_left = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    JobSpec spec = small_job(1 + static_cast<int>(seed % 5), 10, 1 + static_cast<int>(seed % 4),
                             seed % 3 != 0);
    if (seed % 4 == 0) spec = moving_job(4, 8, 1 + static_cast<int>(seed % 9));
    spec.visibility.correlated = seed % 3 == 1;
    spec.max_retries_per_task = 1000000;
    spec.max_failures_per_worker = 1000000;
    ChaosFarm farm(seed, spec, /*alike=*/seed % 2 == 0);
    int steps = 0;
    for (; farm.status() == JobStatus::running && steps < 20000; ++steps)
      farm.advance(/*trouble=*/steps < 3000);
    EXPECT_EQ(farm.status(), JobStatus::done) << "after " << steps << " steps";
    EXPECT_EQ(farm.num_recorded(), farm.num_tasks());
    EXPECT_EQ(farm.progress().tasks_open, 0u);
    EXPECT_EQ(farm.progress().tasks_leased, 0u);
    EXPECT_GE(farm.num_removed(), 4u) << "the films are gone";
    num_left += farm.num_left();
    farm.delete_job();
    EXPECT_EQ(farm.num_left(), 0u);
    num_missing += farm.num_missing();
    num_lost += farm.num_lost();
    num_reopened += farm.num_reopened();
    num_events += farm.num_events();
    if (testing::Test::HasFailure()) return;
  }
  RecordProperty("events", std::to_string(num_events));
  EXPECT_GT(num_left, 500u) << "the last states, until their jobs are deleted";
  EXPECT_GT(num_lost, 1000u);
  EXPECT_GT(num_reopened, 1000u) << "something was done again";
  EXPECT_GT(num_missing, 20u) << "alike blobs went between publishing and reporting";
}

// A result that is not there costs time and nothing else: with no retries allowed the job ends
// well.
TEST(SchedulerModel, NobodyIsBlamedForBlobsThatAreAlike) {
  std::size_t num_missing = 0;
  for (std::uint32_t seed = 1; seed <= 1000; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    JobSpec spec = small_job(4, 12, 3);
    spec.max_retries_per_task = 0;
    spec.max_failures_per_worker = 1;
    ChaosFarm farm(seed, spec, /*alike=*/true);
    int steps = 0;
    for (; farm.status() == JobStatus::running && steps < 20000; ++steps)
      farm.advance(/*trouble=*/false);
    EXPECT_EQ(farm.status(), JobStatus::done) << "after " << steps << " steps";
    EXPECT_EQ(farm.num_failures(), 0u);
    num_missing += farm.num_missing();
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(num_missing, 20u);
}

TEST(SchedulerModel, AJobAlwaysEndsWhenAttemptsAreLimited) {
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    JobSpec spec = small_job(4, 12, 3);
    spec.max_retries_per_task = 1;
    spec.max_failed_tasks = 2;
    spec.max_failures_per_worker = 3;
    ChaosFarm farm(seed, spec, /*alike=*/seed % 2 == 0);
    int steps = 0;
    for (; farm.status() == JobStatus::running && steps < 20000; ++steps)
      farm.advance(/*trouble=*/true);
    EXPECT_NE(farm.status(), JobStatus::running);
    EXPECT_EQ(farm.progress().tasks_open, 0u);
    EXPECT_EQ(farm.progress().tasks_leased, 0u);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace baton
