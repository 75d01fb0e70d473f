#include <gtest/gtest.h>

#include "coordinator/schedule/blob_references.h"
#include "coordinator/schedule/job_graph.h"
#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using testing_farm::assemble;
using testing_farm::moving_job;
using testing_farm::outputs_of;
using testing_farm::render;
using testing_farm::small_job;

TEST(JobGraph, IndexAndKeyAreInverse) {
  const JobGraph graph(small_job(3, 5, 2));
  ASSERT_EQ(graph.num_tasks(), 5 + 3 * 3);
  for (TaskIndex i = 0; i < graph.num_tasks(); ++i) EXPECT_EQ(graph.find(graph.key(i)), i);
}

TEST(JobGraph, UnknownKeysAreNotFound) {
  const JobGraph graph(small_job(3, 5, 2));
  EXPECT_FALSE(graph.find(render(3, 0)));
  EXPECT_FALSE(graph.find(render(0, 3)));
  EXPECT_FALSE(graph.find(render(-1, 0)));
  EXPECT_FALSE(graph.find(assemble(5)));
  EXPECT_FALSE(graph.find({TaskKind::assemble, 0, 1}));
}

TEST(JobGraph, InputsAndDependentsMirrorEachOther) {
  for (const JobSpec& spec :
       {small_job(3, 5, 2), small_job(3, 5, 2, false), moving_job(5, 5, 9), moving_job(5, 5, 1),
        with_sweeps(small_job(3, 5, 2), 3), with_sweeps(small_job(3, 5, 2, false), 2),
        with_sweeps(small_job(3, 1, 2), 4), with_sweeps(moving_job(5, 4, 9), 3),
        with_sweeps(moving_job(5, 1, 1), 3)}) {
    const JobGraph graph(spec);
    for (TaskIndex task = 0; task < graph.num_tasks(); ++task) {
      const std::vector<TaskIndex> inputs = graph.inputs(graph.key(task));
      EXPECT_EQ(static_cast<std::int32_t>(inputs.size()), graph.num_inputs(graph.key(task)));
      for (const TaskIndex input : inputs) {
        const std::vector<TaskIndex> dependents = graph.dependents(graph.key(input));
        EXPECT_EQ(std::count(dependents.begin(), dependents.end(), task), 1);
      }
    }
  }
}

// Five frames in runs of two: each sweep begins with a run of its own.
TEST(JobGraph, ALaterSweepTakesTheFilmsOfTheOneBefore) {
  const JobGraph graph(with_sweeps(small_job(3, 5, 2), 2));
  EXPECT_EQ(graph.num_tasks(), 5 + 6 * 3);
  EXPECT_EQ(graph.steps(render(3, 0)), (StepSpan{Step(5), Step(6)}));
  EXPECT_EQ(graph.steps(render(4, 0)), (StepSpan{Step(7), Step(8)}));
  const auto keys = [&](const std::vector<TaskIndex>& tasks) {
    std::vector<TaskKey> result;
    for (const TaskIndex task : tasks) result.push_back(graph.key(task));
    return result;
  };
  EXPECT_EQ(keys(graph.inputs(render(3, 1))), (std::vector{render(2, 1), render(0, 1)}));
  EXPECT_EQ(keys(graph.dependents(render(0, 1))), (std::vector{render(1, 1), render(3, 1)}));
  EXPECT_EQ(keys(graph.inputs(assemble(4))),
            (std::vector{render(5, 0), render(5, 1), render(5, 2)}));
  EXPECT_EQ(keys(graph.dependents(render(3, 1))),
            (std::vector{assemble(0), assemble(1), render(4, 1)}));

  // Of a run's state and two films the next sweep takes the films, the next run the state.
  EXPECT_EQ(graph.taken_outputs(render(3, 1), render(0, 1)), (std::vector<std::size_t>{1, 2}));
  EXPECT_EQ(graph.taken_outputs(render(1, 1), render(0, 1)), (std::vector<std::size_t>{0}));
  EXPECT_TRUE(graph.taken_outputs(render(3, 2), render(0, 1)).empty());

  // Of a still, one task takes both.
  const JobGraph still(with_sweeps(small_job(3, 1, 2), 3));
  EXPECT_EQ(still.inputs(render(1, 2)).size(), 1u);
  EXPECT_EQ(still.taken_outputs(render(1, 2), render(0, 2)), (std::vector<std::size_t>{0, 1}));
}

TEST(JobGraph, WhereThingsMoveATileNeedsItsNeighboursInReach) {
  const auto tiles = [](const JobGraph& graph, const TaskKey& task) {
    std::vector<std::int32_t> result;
    for (const TaskIndex input : graph.inputs(task)) {
      EXPECT_EQ(graph.key(input).run() + 1, task.run());
      result.push_back(graph.key(input).tile);
    }
    return result;
  };
  // Tiles of 8 pixels in a row; a run is one frame whatever checkpoint_every says.
  const JobGraph graph(moving_job(5, 4, /*reach_px=*/8));
  EXPECT_EQ(graph.num_tasks(), 4 + 4 * 5);
  EXPECT_TRUE(tiles(graph, render(0, 2)).empty());
  EXPECT_EQ(tiles(graph, render(1, 2)), (std::vector<std::int32_t>{1, 2, 3}));
  EXPECT_EQ(tiles(graph, render(1, 0)), (std::vector<std::int32_t>{0, 1}));
  EXPECT_EQ(tiles(JobGraph(moving_job(5, 4, 9)), render(3, 2)),
            (std::vector<std::int32_t>{0, 1, 2, 3, 4}));
}

TEST(JobGraph, WithoutCarriedSamplesMotionNeedsNoNeighbours) {
  JobSpec spec = moving_job(5, 4, 8);
  spec.state.carry = false;
  const JobGraph graph(spec);
  EXPECT_EQ(graph.num_tasks(), 4 + 2 * 5);
  EXPECT_EQ(graph.num_inputs(render(1, 2)), 0);
}

/// 3 x 2 tiles of 8 pixels, 3 frames, 2 in a run, with a second pass that reaches 4 pixels.
JobSpec second_pass_job(bool carry) {
  JobSpec job = small_job(3, 3, 2, carry);
  job.image.height = 16;
  job.visibility.correlated = true;
  return job;
}

TEST(JobGraph, SecondPassStandsBetweenRenderAndAssembly) {
  for (const bool carry : {true, false}) {
    const JobGraph graph(second_pass_job(carry));
    ASSERT_EQ(graph.num_tasks(), 3 + 3 * 6 + 2 * 6);
    for (TaskIndex task = 0; task < graph.num_tasks(); ++task) {
      EXPECT_EQ(graph.find(graph.key(task)), task);
      const std::vector<TaskIndex> inputs = graph.inputs(graph.key(task));
      EXPECT_EQ(static_cast<std::int32_t>(inputs.size()), graph.num_inputs(graph.key(task)));
      for (const TaskIndex input : inputs) {
        const std::vector<TaskIndex> dependents = graph.dependents(graph.key(input));
        EXPECT_EQ(std::count(dependents.begin(), dependents.end(), task), 1);
        EXPECT_FALSE(graph.taken_outputs(graph.key(task), graph.key(input)).empty());
      }
    }
    // The corner tile looks at the four tiles around it, the middle one at all six.
    EXPECT_EQ(graph.num_inputs(second_pass_task(Step(2), 0)), 4);
    EXPECT_EQ(graph.num_inputs(second_pass_task(Step(2), 1)), 6);
  }
  EXPECT_FALSE(JobGraph(small_job(3, 3, 2)).find(second_pass_task(Step(0), 0)));
}

TEST(JobGraph, OutputsMustBeExactlyWhatTheTaskMakes) {
  const JobSpec spec = small_job(3, 5, 2);
  const JobGraph graph(spec);
  const TaskKey task = render(1, 2);
  const std::vector<BlobRef> right = outputs_of(spec, {}, task);
  ASSERT_EQ(right.size(), 3u);

  std::vector<BlobRef> outputs = right;
  EXPECT_FALSE(graph.check_outputs(task, outputs));
  EXPECT_EQ(outputs.front().kind, BlobKind::state);
  EXPECT_EQ(graph.taken_outputs(assemble(3), task), std::vector<std::size_t>{2});
  EXPECT_EQ(outputs[2].step(), Step(3));

  outputs = {right[0], right[2]};
  EXPECT_EQ(graph.check_outputs(task, outputs),
            "the report lacks the film of frame index 3, tile 2");
  outputs = {right[0], right[1]};
  EXPECT_EQ(graph.check_outputs(task, outputs),
            "the report lacks the state of frame index 3, tile 2");
  outputs = {right[0], right[1], right[1], right[2]};
  EXPECT_TRUE(graph.check_outputs(task, outputs));
  outputs = right;
  outputs[0].tile = 1;
  EXPECT_TRUE(graph.check_outputs(task, outputs));
}

TEST(JobGraph, StatisticsMustBeOfTheTasksOwnFramesAndTile) {
  const JobGraph graph(small_job(3, 5, 2));
  const TaskKey task = render(1, 2);  // frames 2 and 3
  EXPECT_FALSE(graph.check_frames(task, {}));
  EXPECT_FALSE(graph.check_frames(task, {{2, 2, {}}, {3, 2, {}}}));
  EXPECT_TRUE(graph.check_frames(task, {{2, 1, {}}})) << "another tile";
  EXPECT_TRUE(graph.check_frames(task, {{1, 2, {}}})) << "before the run";
  EXPECT_TRUE(graph.check_frames(task, {{4, 2, {}}})) << "after the run";
  EXPECT_TRUE(graph.check_frames(task, {{3, 2, {}}, {3, 2, {}}})) << "twice";
  EXPECT_FALSE(graph.check_frames(assemble(2), {{2, 0, {}}})) << "what was seen of the frame";
  EXPECT_TRUE(graph.check_frames(assemble(2), {{3, 0, {}}})) << "another frame";
  EXPECT_TRUE(graph.check_frames(assemble(2), {{2, 0, {}}, {2, 0, {}}})) << "twice";
  EXPECT_TRUE(graph.check_frames(second_pass_task(Step(2), 1), {{2, 1, {}}}));
}

TEST(BlobReferences, ASharedBlobIsGarbageWhenItsLastUserLetsGo) {
  BlobReferences blobs;
  const Digest shared{1, 2};
  blobs.add({BlobKind::film, 0, 0, shared, 100});
  blobs.add({BlobKind::film, 0, 1, shared, 100});
  blobs.release(shared);
  EXPECT_TRUE(blobs.take_garbage().empty());
  blobs.release(shared);
  EXPECT_EQ(blobs.take_garbage(), std::vector<Digest>{shared});
  EXPECT_TRUE(blobs.take_garbage().empty());
}

TEST(BlobReferences, ABlobThatIsNeededAgainIsNoGarbage) {
  BlobReferences blobs;
  const BlobRef blob{BlobKind::film, 0, 0, {1, 2}, 100};
  blobs.add(blob);
  blobs.release(blob.digest);
  blobs.add(blob);
  EXPECT_TRUE(blobs.take_garbage().empty());
}

TEST(BlobReferences, CountsTheBytesOfEachBlobOnceWhileItIsThere) {
  BlobReferences blobs;
  const BlobRef shared{BlobKind::film, 0, 0, {1, 2}, 100}, other{BlobKind::state, 0, 0, {3, 4}, 7};
  blobs.expect(other.digest);
  blobs.add({BlobKind::state, 0, 1, {5, 6}, 0});
  EXPECT_EQ(blobs.size_bytes(), 0u) << "one is expected, one is held";
  blobs.add(shared);
  blobs.add(shared);
  blobs.add(other);
  EXPECT_EQ(blobs.size_bytes(), 107u);
  blobs.release(shared.digest);
  blobs.release(other.digest);
  EXPECT_EQ(blobs.size_bytes(), 107u);
  blobs.release(shared.digest);
  EXPECT_EQ(blobs.size_bytes(), 7u);
  blobs.release(other.digest);
  EXPECT_EQ(blobs.size_bytes(), 0u);
}

}  // namespace
}  // namespace baton
