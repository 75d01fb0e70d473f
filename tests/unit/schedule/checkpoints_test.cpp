#include "coordinator/schedule/checkpoints.h"

#include <gtest/gtest.h>

#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;

constexpr int kTiles = 4, kFrames = 40, kEvery = 5;

/// Frames are runs; checkpoints are the states of runs 4, 9, 14, ...
JobSpec in_motion() {
  JobSpec job = moving_job(kTiles, kFrames, 3);
  job.state.checkpoint_every = kEvery;
  return job;
}

/// A farm with one worker that keeps count of the states in the store.
class CheckpointFarm : public Farm {
 public:
  explicit CheckpointFarm(const JobSpec& spec) : Farm(spec) {
    note(submit());
    note(step(WorkerJoined{"a", {}}));
  }

  /// Works until a task of this run is granted, and returns that.
  GrantLease work_until(int run) {
    for (;;) {
      const std::vector<Action> actions = step(WorkRequested{"a", 1});
      note(actions);
      const auto grants = all_of<GrantLease>(actions);
      if (grants.empty()) return {};
      if (grants[0].lease.task.kind == TaskKind::render && grants[0].lease.task.run() >= Run(run))
        return grants[0];
      note(finish(grants[0]));
    }
  }
  /// Finishes a task, and the job.
  void work_from(const GrantLease& grant) {
    note(finish(grant));
    work_until(kFrames);
  }
  /// The tasks that are done again because a worker misses an input.
  std::vector<TaskKey> lose(const GrantLease& grant, const BlobRef& input) {
    const std::vector<Action> actions = step(InputsLost{"a", grant.lease, {input}});
    note(actions);
    std::vector<TaskKey> again;
    for (const auto& record : all_of<RecordReopened>(actions)) again = record.tasks;
    return again;
  }
  std::set<int> steps_of_states() const { return states_.steps(); }
  const std::vector<Completion>& completions() const { return completions_; }

 private:
  void note(const std::vector<Action>& actions) {
    for (const RecordCompletion& done : all_of<RecordCompletion>(actions))
      completions_.push_back(done.completion);
    states_.note(actions);
  }

  StoredStates states_;
  std::vector<Completion> completions_;
};

int first_run(const std::vector<TaskKey>& tasks) {
  int first = kFrames;
  for (const TaskKey& task : tasks) {
    if (task.kind == TaskKind::render) first = std::min(first, task.run().value());
  }
  return first;
}

TEST(Checkpoints, TwoCompleteOnesStayInMotion) {
  CheckpointFarm farm(in_motion());
  const GrantLease next = farm.work_until(23);
  EXPECT_EQ(farm.steps_of_states(), (std::set<int>{14, 19, 22}));
  farm.work_from(next);
  EXPECT_EQ(farm.status(), JobStatus::done);
  EXPECT_EQ(farm.steps_of_states(), std::set<int>{kFrames - 1}) << "the result";
}

// Where a pixel depends on itself alone, each tile has its own.
TEST(Checkpoints, TwoOfEachTileStayAtRest) {
  CheckpointFarm farm(small_job(2, 40, kEvery));
  farm.work_until(5);
  EXPECT_EQ(farm.steps_of_states(), (std::set<int>{19, 24}));
}

TEST(Checkpoints, ALostStateIsMadeFromTheNewestCheckpoint) {
  CheckpointFarm farm(in_motion());
  const GrantLease grant = farm.work_until(23);
  const std::vector<TaskKey> again = farm.lose(grant, grant.inputs.front());
  EXPECT_EQ(first_run(again), 20);
  EXPECT_LE(again.size(), std::size_t{3 * kTiles});
  farm.work_until(kFrames);
  EXPECT_EQ(farm.status(), JobStatus::done);
}

TEST(Checkpoints, ALostCheckpointIsMadeFromTheOneBefore) {
  CheckpointFarm farm(in_motion());
  const GrantLease grant = farm.work_until(20);
  const std::vector<TaskKey> again = farm.lose(grant, grant.inputs.front());
  EXPECT_EQ(first_run(again), 15);
}

// The coordinator starts again and does not find a checkpoint that nobody needs: it is not made
// again, and nobody counts on it later.
TEST(Checkpoints, AnOlderOneThatIsGoneIsLetGo) {
  CheckpointFarm farm(in_motion());
  farm.work_until(23);
  Farm again(in_motion(), 2);
  BlobRef gone;  // the state of run 14, tile 0
  for (const Completion& done : farm.completions()) {
    for (const BlobRef& blob : done.made.outputs) {
      if (blob.kind == BlobKind::state && blob.step() == Step(14) && blob.tile == 0) gone = blob;
    }
  }
  const auto actions = again.step(JobAdded{.job = again.job,
                                           .spec = again.spec(),
                                           .completions = completions_of(farm.completions()),
                                           .failures = {},
                                           .lost_spares = {gone}});
  EXPECT_TRUE(all_of<RecordReopened>(actions).empty());
  const JobTasks& tasks = again.scheduler.find_job(again.job)->tasks;
  for (int tile = 0; tile < kTiles; ++tile) {
    EXPECT_TRUE(
        tasks.ledger().spare_blobs(tasks.view(), *tasks.graph().find(render(14, tile))).empty());
    EXPECT_FALSE(
        tasks.ledger().spare_blobs(tasks.view(), *tasks.graph().find(render(19, tile))).empty());
  }
  again.step(WorkerJoined{"a", {}});
  again.work_off("a");
  EXPECT_EQ(again.status(), JobStatus::done);
}

}  // namespace
}  // namespace baton
