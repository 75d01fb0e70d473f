#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/job/motion.h"
#include "common/job/plan/store_estimate.h"
#include "coordinator/schedule/waits.h"
#include "tests/unit/schedule/farm.h"

/// Several jobs in one store with a limit. Whatever is begun, paused, requeued or put first, a farm
/// whose workers are idle has nothing to do: each job that fits alone ends as done, the others as
/// failed. Jobs that have ended are deleted.
namespace baton {
namespace {

using namespace testing_farm;

JobSpec any_job(std::mt19937& random) {
  const auto roll = [&](int sides) {
    return static_cast<int>(random() % static_cast<unsigned>(sides));
  };
  const int tiles = 1 + roll(6), frames = 4 + roll(16);
  JobSpec spec = small_job(tiles, frames, 1 + roll(4), roll(4) != 0);
  if (roll(4) == 0) spec = moving_job(tiles, frames, 1);
  spec.visibility.correlated = roll(3) == 0;
  if (!spec.visibility.correlated && roll(4) == 0)
    spec = with_sweeps(spec, 1 + roll(3), roll(2) == 0);
  spec.state.keep = roll(8) == 0 ? StateKeep::all : StateKeep::last;
  spec.priority = 10 * roll(10);
  return spec;
}

/// What the store must take for the job alone: the states and films that stay; a run, and a state
/// of each tile that it reads; and what is begun of runs that wait while frames before them are
/// rendered once more.
std::uint64_t fullest(const JobSpec& spec, bool is_requeued) {
  const auto size_of = [&](BlobKind kind) { return estimate_blob_bytes(spec, kind); };
  const auto per_run = std::min<std::int64_t>(frames_per_run(spec), num_steps(spec));
  const std::int64_t between = shares_history(spec) ? spec.state.checkpoint_every : 0;
  const std::int64_t states =
      carries_state(spec) ? num_state_sets(spec) + (is_requeued ? 2 : 1) + between : 0;
  const std::int64_t frame =
      size_of(BlobKind::film) +
      (spec.visibility.correlated ? size_of(BlobKind::film) + size_of(BlobKind::first_pass) : 0);
  // Films that stay are those of runs; a few tasks more make theirs.
  const std::int64_t tiles = spec.image.width / 8, stay = num_films_that_stay(spec);
  const std::int64_t runs = (is_requeued ? 2 : 1) * frame * per_run;
  return static_cast<std::uint64_t>(
      tiles * (size_of(BlobKind::state) * states + size_of(BlobKind::film) * stay) +
      (stay > 0 ? std::min<std::int64_t>(4, tiles) : tiles) * runs);
}

class SharedStore {
 public:
  /// spread: sizes of blobs are up to so much larger or smaller, as a share. room: the limit, as a
  /// share of one in which each job fits.
  SharedStore(std::uint32_t seed, double spread, bool requeues, double room = 1)
      : random_(seed),
        spread_(spread),
        requeues_(requeues),
        room_(room),
        scheduler_({1, kSilence, any_limit(), false}) {
    for (int i = 0; i <= roll(4); ++i)
      scheduler_.step(WorkerJoined{workers_.emplace_back(1, static_cast<char>('a' + i)), {}}, now_);
  }

  void advance() {
    switch (roll(64)) {
      case 0:
      case 1:
        return submit();
      case 2:
        return on_any([&](const Digest& job) { step(PriorityChanged{job, roll(100)}); });
      case 3:
        return on_any([&](const Digest& job) { step(JobPaused{job, {}}); });
      case 4:
      case 5:
        return on_any([&](const Digest& job) { step(JobResumed{job}); });
      case 6:
        if (requeues_) on_any([&](const Digest& job) { requeue(job); });
        return;
      default:
        break;
    }
    if (roll(3) == 0 || held_.empty())
      step(
          WorkRequested{workers_[static_cast<std::size_t>(roll(static_cast<int>(workers_.size())))],
                        1 + roll(3)});
    else
      finish_any();
  }

  void resume_all() {
    while (num_submitted_ < specs_.size()) submit();
    for (const auto& [job, spec] : std::map(jobs_)) step(JobResumed{job});
  }
  /// Nothing happens any more but work. Returns whether all jobs have ended, and are deleted.
  bool work_off() {
    for (int idle = 0; idle < 8; ++idle) {
      do {
        for (const std::string& worker : workers_) step(WorkRequested{worker, 1 + roll(2)});
        if (!held_.empty()) idle = 0;
        if (!held_.empty()) finish_any();
      } while (!held_.empty());
      if (const std::size_t num_left = jobs_.size(); step(ClockTicked{}), num_left > jobs_.size())
        idle = 0;
    }
    return jobs_.empty();
  }
  std::string why() const {
    std::string text;
    for (const auto& [job, spec] : jobs_) {
      const Scheduler::Job& j = *scheduler_.find_job(job);
      std::uint64_t held = 0, films = 0;
      for (TaskIndex t = 0; t < j.tasks.graph().num_tasks(); ++t)
        for (const BlobRef& b : j.tasks.ledger().live_blobs(j.tasks.view(), t)) {
          held += b.size_bytes;
          if (b.kind == BlobKind::film) films += b.size_bytes;
        }
      text +=
          waits_for(scheduler_, job, now_) + "\n  open " +
          std::to_string(j.tasks.progress().tasks_open) + " tiles " +
          std::to_string(j.tasks.graph().num_tiles()) + " frames " +
          std::to_string(spec.frames.size()) + " per run " + std::to_string(frames_per_run(spec)) +
          " carry " + std::to_string(carries_state(spec)) + " corr " +
          std::to_string(spec.visibility.correlated) + " sweeps " +
          std::to_string(spec.quality.sweeps) + " refinable " +
          std::to_string(spec.quality.refinable) + " keepall " +
          std::to_string(spec.state.keep == StateKeep::all) + " moving " +
          std::to_string(shares_history(spec)) + " begun " + std::to_string(j.begun_runs.value()) +
          " first open run " + std::to_string(j.tasks.book().first_open_run().value()) + " of " +
          std::to_string(j.tasks.graph().num_runs()) + " known " +
          std::to_string(j.sizes.are_known(j.tasks.graph(), render(0, 0))) + " prio " +
          std::to_string(j.spec.priority) + " fullest " + std::to_string(fullest(spec, true)) +
          " live " + std::to_string(held) + " films " + std::to_string(films) + " sets " +
          std::to_string(num_state_sets(spec)) + "\n";
    }
    return text;
  }
  std::uint64_t most_bytes() const { return most_bytes_; }
  std::uint64_t limit() const { return scheduler_.room().limit; }
  std::size_t num_requeued() const { return num_requeued_; }
  std::size_t num_beside() const { return num_beside_; }
  std::size_t num_failed() const { return num_failed_; }
  std::uint64_t store_bytes() const { return scheduler_.store_bytes(); }
  std::size_t num_jobs() const { return specs_.size(); }

 private:
  int roll(int sides) { return static_cast<int>(random_() % static_cast<unsigned>(sides)); }

  std::uint64_t any_limit() {
    for (int i = 0; i < 2 + roll(3); ++i) specs_.push_back(any_job(random_));
    double most = 0;
    for (const JobSpec& spec : specs_)
      most = std::max(most, static_cast<double>(fullest(spec, requeues_)));
    return static_cast<std::uint64_t>(room_ * most * (1 + spread_) *
                                      (1 + 0.1 * roll(10) + (requeues_ ? 0.5 : 0)));
  }
  template <class F>
  void on_any(const F& act) {
    if (jobs_.empty()) return;
    act(std::next(jobs_.begin(), roll(static_cast<int>(jobs_.size())))->first);
  }
  void submit() {
    if (num_submitted_ == specs_.size()) return;
    const Digest job = digest_of("job " + std::to_string(num_submitted_));
    const JobSpec& spec = jobs_.emplace(job, specs_[num_submitted_++]).first->second;
    step(JobAdded{job, spec, JobStatus::running, {}, {}});
  }
  /// A frame that is done is rendered once more.
  void requeue(const Digest& digest) {
    const Scheduler::Job& job = *scheduler_.find_job(digest);
    const JobGraph& graph = job.tasks.graph();
    const FrameIndex frame(roll(graph.num_frames()));
    const auto is_done = [&](const TaskKey& key) {
      return job.tasks.book().status(*graph.find(key)) == TaskStatus::done;
    };
    if (!is_open(job.status) || !is_done(assemble_task(frame))) return;
    ++num_requeued_;
    TasksReopened again{digest, {assemble_task(frame)}, "somebody wants it", true};
    for (const TaskIndex input : graph.inputs(assemble_task(frame))) {
      if (is_done(graph.key(input))) again.tasks.push_back(graph.key(input));
    }
    step(again);
  }
  void finish_any() {
    const auto found = held_.begin() + roll(static_cast<int>(held_.size()));
    const GrantLease grant = *found;
    held_.erase(found);
    const JobSpec& spec = jobs_.at(grant.lease.job);
    std::vector<BlobRef> made =
        outputs_of_grant(spec, grant.lease.job, grant.lease.task, grant.steps);
    for (BlobRef& blob : made) {
      const auto share = static_cast<double>(std::hash<std::string>()(blob.digest.hex()) % 1000);
      blob.size_bytes =
          static_cast<std::uint64_t>(static_cast<double>(estimate_blob_bytes(spec, blob.kind)) *
                                     (1 + spread_ * (share / 500 - 1)));
    }
    step(TaskCompleted{grant.worker, grant.lease, {made}});
  }
  void step(const Event& event) {
    std::vector<Digest> inspected, done;
    for (const Action& action : scheduler_.step(event, now_)) {
      if (const auto* grant = std::get_if<GrantLease>(&action)) held_.push_back(*grant);
      if (const auto* inspect = std::get_if<InspectFrames>(&action))
        inspected.push_back(inspect->job);
      if (const auto* end = std::get_if<RevokeLease>(&action))
        std::erase_if(held_, [&](const GrantLease& held) { return held.lease == end->lease; });
    }
    std::erase_if(jobs_, [&](const auto& job) {
      const Scheduler::Job& known = *scheduler_.find_job(job.first);
      if (is_open(known.status)) return false;
      done.push_back(job.first);
      if (known.status == JobStatus::done) return true;
      ++num_failed_;
      EXPECT_TRUE(known.is_hopeless);
      EXPECT_GT(static_cast<double>(fullest(job.second, requeues_)) * (1 + spread_),
                static_cast<double>(limit()));
      std::erase_if(held_, [&](const GrantLease& held) { return held.lease.job == job.first; });
      return true;
    });
    most_bytes_ = std::max(most_bytes_, scheduler_.store_bytes());
    const auto begun = std::ranges::count_if(jobs_, [&](const auto& job) {
      return scheduler_.find_job(job.first)->begun_runs > Run(0);
    });
    num_beside_ += begun > 1 ? 1 : 0;
    for (const Digest& job : inspected) step(FramesInspected{job});
    for (const Digest& job : done) step(JobForgotten{job});
  }

  std::mt19937 random_;
  double spread_;
  bool requeues_;
  double room_;
  std::vector<JobSpec> specs_;
  Scheduler scheduler_;
  std::vector<std::string> workers_;
  std::size_t num_submitted_ = 0, num_requeued_ = 0, num_beside_ = 0, num_failed_ = 0;
  std::map<Digest, JobSpec> jobs_;
  std::vector<GrantLease> held_;
  std::uint64_t most_bytes_ = 0;
  TimePoint now_{};
};

TEST(SharedStore, JobsOfWhichEachFitsAloneAllEnd) {
  std::size_t num_felt = 0, num_requeued = 0, num_beside = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    SharedStore farm(seed, seed % 2 == 0 ? 0.2 : 0.0, seed % 4 < 2);
    for (int steps = 0; steps < 1500; ++steps) farm.advance();
    farm.resume_all();
    ASSERT_TRUE(farm.work_off()) << "the farm stands still: " << farm.why();
    EXPECT_EQ(farm.num_failed(), 0u);
    EXPECT_EQ(farm.store_bytes(), 0u);
    EXPECT_LE(farm.most_bytes(), farm.limit() + farm.limit() / (seed % 2 == 0 ? 4 : 8));
    num_felt += farm.most_bytes() * 4 > farm.limit() * 3 ? 1 : 0;
    num_requeued += farm.num_requeued();
    num_beside += farm.num_beside() > 20 ? 1 : 0;
  }
  EXPECT_GT(num_felt, num_seeds() / 16) << "stores that were nearly full";
  EXPECT_GT(num_requeued, num_seeds()) << "frames that were rendered once more";
  EXPECT_GT(num_beside, num_seeds() / 4) << "farms with several jobs that were begun";
}

// Jobs for which the store is too small fail, and keep none of the others.
TEST(SharedStore, WhatDoesNotFitAloneFailsAndAllOthersEnd) {
  std::size_t num_failed = 0, num_mixed = 0;
  for (std::uint32_t seed = 1; seed <= num_seeds(); ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    SharedStore farm(seed, seed % 2 == 0 ? 0.2 : 0.0, seed % 4 < 2, 0.1 + 0.1 * (seed % 7));
    for (int steps = 0; steps < 1500; ++steps) farm.advance();
    farm.resume_all();
    ASSERT_TRUE(farm.work_off()) << "the farm stands still: " << farm.why();
    EXPECT_EQ(farm.store_bytes(), 0u);
    num_failed += farm.num_failed() > 0 ? 1 : 0;
    num_mixed += farm.num_failed() > 0 && farm.num_failed() < farm.num_jobs() ? 1 : 0;
  }
  EXPECT_GT(num_failed, num_seeds() / 4);
  EXPECT_GT(num_mixed, num_seeds() / 8) << "farms in which some failed and some were done";
}

}  // namespace
}  // namespace baton
