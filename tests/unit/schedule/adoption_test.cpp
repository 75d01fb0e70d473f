#include "coordinator/schedule/adoption.h"

#include <gmock/gmock.h>

#include "common/job/motion.h"
#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;
using testing::ElementsAre;
using testing::IsEmpty;

/// One output folder and one store: a job works, then another of the same picture.
class Shop {
 public:
  /// Does at most `count` tasks of the job with what there is. Returns those that were done.
  std::vector<TaskKey> work(JobSpec wanted, int count = 1000000) {
    const KeptFiles files{
        .has_frame =
            [&](FrameIndex frame, const BlobRef& image) {
              const auto found = frames_.find(wanted.frames[frame.index()]);
              return found != frames_.end() && found->second == image.digest;
            },
        .has_blob = [&](const BlobRef& blob) { return store_.contains(blob.digest); }};
    adoption_ = adopt(document_of(wanted), formers_, files);
    wanted.leading_runs = adoption_.plan.leading_runs;
    Farm farm(wanted);
    farm.job = digest_of("tiles of " + std::to_string(wanted.image.tile_size));
    std::vector<Completion> done = inherited();
    JobAdded added{farm.job, wanted, JobStatus::running, completions_of(done), {}};
    added.plan = adoption_.plan;
    note(farm.step(added), done);
    note(farm.step(WorkerJoined{"a", {}}), done);
    std::vector<TaskKey> tasks;
    while (static_cast<int>(tasks.size()) < count && farm.status() == JobStatus::running) {
      const GrantLease grant = farm.ask_one("a");
      for (const BlobRef& input : grant.inputs)
        EXPECT_TRUE(store_.contains(input.digest)) << "an input that is not there";
      const auto outputs = outputs_of_grant(wanted, farm.job, grant.lease.task, grant.steps);
      for (const BlobRef& blob : outputs) {
        store_.insert(blob.digest);
        if (blob.kind == BlobKind::image)
          frames_[wanted.frames[blob.frame().index()]] = blob.digest;
      }
      inputs_of_last_ = grant.inputs;
      if (tasks.empty()) first_inputs_ = grant.inputs;
      tasks.push_back(grant.lease.task);
      note(farm.step(TaskCompleted{"a", grant.lease, {outputs}}), done);
    }
    formers_.push_back(
        {document_of(wanted), completions_of(done).tasks, adoption_.plan, farm.status()});
    return tasks;
  }
  void lose_states() { store_.clear(); }
  void lose_frame(int number) { frames_.erase(FrameNumber(number)); }
  const Adoption& adoption() const { return adoption_; }
  /// Of the first task of the last job.
  const std::vector<BlobRef>& first_inputs() const { return first_inputs_; }

 private:
  std::vector<Completion> inherited() const {
    std::vector<Completion> done;
    if (adoption_.former) {
      for (const Completions::Task& task : formers_[*adoption_.former].tasks) {
        if (std::count(adoption_.tasks.begin(), adoption_.tasks.end(), task.task) > 0)
          done.push_back({task.task, {task.outputs}});
      }
    }
    done.insert(done.end(), adoption_.frames.begin(), adoption_.frames.end());
    for (const TaskKey& task : adoption_.skipped) done.push_back({task, {}});
    return done;
  }
  /// The archive keeps all states, so removals are left out.
  void note(const std::vector<Action>& actions, std::vector<Completion>& done) {
    for (const auto& record : all_of<RecordReopened>(actions)) {
      for (const TaskKey& task : record.tasks)
        std::erase_if(done, [&](const Completion& c) { return c.task == task; });
    }
    for (const auto& record : all_of<RecordCompletion>(actions)) done.push_back(record.completion);
  }

  std::vector<FormerJob> formers_;
  std::set<Digest> store_;
  std::map<FrameNumber, Digest> frames_;
  Adoption adoption_;
  std::vector<BlobRef> first_inputs_, inputs_of_last_;
};

std::set<int> rendered_runs(const std::vector<TaskKey>& tasks) {
  std::set<int> runs;
  for (const TaskKey& task : tasks) {
    if (task.kind == TaskKind::render) runs.insert(task.run().value());
  }
  return runs;
}
std::set<int> written_frames(const std::vector<TaskKey>& tasks) {
  std::set<int> frames;
  for (const TaskKey& task : tasks) {
    if (task.kind == TaskKind::assemble) frames.insert(task.frame().value());
  }
  return frames;
}

JobSpec with_frames(JobSpec job, int first, int last) {
  job.frames.clear();
  for (int frame = first; frame <= last; ++frame) job.frames.emplace_back(frame);
  return job;
}

// Frames of four in runs of two: the second sweep has runs 2 and 3.
TEST(Adoption, MoreSweepsGoOnFromThoseThatAreDone) {
  for (const JobSpec& job : {small_job(3, 4, 2), small_job(3, 4, 2, false), moving_job(3, 2, 3)}) {
    Shop shop;
    shop.work(with_sweeps(job, 1));
    auto tasks = shop.work(with_sweeps(job, 2));
    EXPECT_EQ(rendered_runs(tasks), (std::set<int>{2, 3}));
    EXPECT_EQ(written_frames(tasks).size(), job.frames.size());
    // The same job again has nothing to do; a third sweep goes on from the second.
    EXPECT_THAT(shop.work(with_sweeps(job, 2)), IsEmpty());
    tasks = shop.work(with_sweeps(job, 3));
    EXPECT_EQ(rendered_runs(tasks), (std::set<int>{4, 5}));
  }
}

TEST(Adoption, AJobThatIsChangedInItsSecondSweepKeepsTheFirst) {
  Shop shop;
  shop.work(with_sweeps(small_job(3, 4, 2), 2), 8);  // six tasks are the first sweep
  const auto tasks = shop.work(with_sweeps(small_job(3, 4, 2), 4));
  EXPECT_EQ(rendered_runs(tasks), (std::set<int>{2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(std::count_if(tasks.begin(), tasks.end(),
                          [](const TaskKey& t) { return t.kind == TaskKind::render; }),
            18 - 2);
}

// What another sweep of more frames starts from is the state of another frame.
TEST(Adoption, OtherFramesKeepTheFirstSweepAlone) {
  Shop shop;
  shop.work(with_sweeps(small_job(3, 4, 2), 2));
  const auto tasks = shop.work(with_sweeps(small_job(3, 6, 2), 2));
  EXPECT_EQ(rendered_runs(tasks), (std::set<int>{2, 3, 4, 5}));
  EXPECT_EQ(written_frames(tasks).size(), 6u);
}

TEST(Adoption, MoreFramesGoOnFromTheLastStatesInMotion) {
  Shop shop;
  shop.work(moving_job(3, 8, 3));
  const auto tasks = shop.work(moving_job(3, 12, 3));
  EXPECT_EQ(rendered_runs(tasks), (std::set<int>{8, 9, 10, 11}));
  EXPECT_EQ(written_frames(tasks), (std::set<int>{8, 9, 10, 11}));
  ASSERT_FALSE(shop.first_inputs().empty());
  EXPECT_EQ(shop.first_inputs().front().step(), Step(7));
}

// The last run of the shorter job was cut short: it stays as it is.
TEST(Adoption, MoreFramesGoOnFromTheLastStatesAtRest) {
  Shop shop;
  shop.work(small_job(2, 8, 12));
  const auto tasks = shop.work(small_job(2, 30, 12));
  EXPECT_THAT(shop.adoption().plan.leading_runs, ElementsAre(Step(0), Step(8)));
  EXPECT_EQ(tasks.size(), 2u * 3 + 22) << "frames 9-12, 13-24 and 25-30 of two tiles";
  EXPECT_EQ(*written_frames(tasks).begin(), 8);
  EXPECT_EQ(shop.first_inputs().front().step(), Step(7));
}

TEST(Adoption, ASecondPassGoesOnToo) {
  JobSpec job = moving_job(3, 4, 3);
  job.visibility.correlated = true;
  Shop shop;
  shop.work(job);
  const auto tasks = shop.work(with_frames(job, 1, 6));
  EXPECT_EQ(tasks.size(), 2u * (3 + 3 + 1));
}

TEST(Adoption, FewerFramesAndOtherSettingsNeedNothing) {
  Shop shop;
  shop.work(small_job(2, 12, 12));
  JobSpec fewer = small_job(2, 5, 7);
  fewer.priority = 90;
  fewer.max_retries_per_task = 9;
  fewer.name = "another name";
  fewer.metadata["shot"] = "12";
  EXPECT_THAT(shop.work(fewer), IsEmpty());
  EXPECT_EQ(shop.adoption().frames.size(), 5u);
  // And what the first job has written is still there for a third.
  EXPECT_THAT(shop.work(small_job(2, 12, 12)), IsEmpty());
}

TEST(Adoption, AnInterruptedJobLeavesItsSingleTasks) {
  Shop shop;
  const auto before = shop.work(small_job(3, 8, 2), 5);
  JobSpec longer = small_job(3, 10, 2);
  const auto after = shop.work(longer);
  EXPECT_EQ(before.size() + after.size(), static_cast<std::size_t>(count_tasks(longer)));
}

TEST(Adoption, StatesAreCutIntoOtherTiles) {
  for (const JobSpec& job : {small_job(4, 6, 3), moving_job(4, 6, 3)}) {
    Shop shop;
    shop.work(job);
    JobSpec larger = with_frames(job, 1, 8);
    larger.image.tile_size = 16;
    const auto tasks = shop.work(larger);
    EXPECT_EQ(written_frames(tasks), (std::set<int>{6, 7}));
    const std::int32_t runs = moves(job) ? 2 : 1;  // after the frame that is cut
    EXPECT_EQ(tasks.size(), static_cast<std::size_t>(2 + 2 * runs + 2));
    ASSERT_EQ(shop.first_inputs().size(), 2u) << "two tiles make one";
    EXPECT_EQ(shop.first_inputs().front().step(), Step(5));
  }
}

// In the middle of the shorter job only checkpoints and the last frame have all states.
TEST(Adoption, WithoutStatesTheChainIsRenderedAndOnlyWhatIsMissingWritten) {
  Shop shop;
  shop.work(moving_job(2, 6, 3));
  shop.lose_states();
  JobSpec larger = moving_job(2, 8, 3);
  larger.image.tile_size = 16;
  const auto tasks = shop.work(larger);
  EXPECT_EQ(rendered_runs(tasks).size(), 8u);
  EXPECT_EQ(written_frames(tasks), (std::set<int>{6, 7}));
}

TEST(Adoption, AFrameThatIsGoneIsMadeAgain) {
  Shop shop;
  shop.work(small_job(2, 6, 2));
  shop.lose_frame(3);
  shop.lose_states();
  JobSpec smaller_tiles = small_job(2, 6, 2);
  smaller_tiles.image.tile_size = 16;
  const auto tasks = shop.work(smaller_tiles);
  EXPECT_EQ(written_frames(tasks), std::set<int>{2});
  EXPECT_EQ(rendered_runs(tasks), (std::set<int>{0, 1}));
  EXPECT_THAT(shop.adoption().lost, ElementsAre(FrameIndex(2)));
}

TEST(Adoption, WithoutHistoryFramesAreKeptByNumber) {
  Shop shop;
  shop.work(with_frames(small_job(2, 4, 3, /*carry=*/false), 5, 8));
  const auto tasks = shop.work(small_job(2, 12, 3, /*carry=*/false));
  EXPECT_EQ(written_frames(tasks), (std::set<int>{0, 1, 2, 3, 8, 9, 10, 11}));
  EXPECT_EQ(tasks.size(), 8u + 2 * 4) << "runs 1-3, 4, 9, 10-12";
}

TEST(Adoption, OtherChannelsAreWrittenAnew) {
  Shop shop;
  shop.work(small_job(2, 4, 2));
  JobSpec more = small_job(2, 4, 2);
  more.output.aovs = {Aov::depth};
  EXPECT_EQ(shop.work(more).size(), static_cast<std::size_t>(count_tasks(more)));
  // Of another format only the assembly, while the films are there.
  more.output.compression = "piz";
  EXPECT_EQ(shop.work(more).size(), 4u);
}

TEST(Adoption, OtherNamesAreWrittenAnewWhereMattesShowThem) {
  JobSpec plain = small_job(2, 4, 2);
  plain.scene.objects = {{.mesh = "m", .material = "m"}};
  for (const bool mattes : {false, true}) {
    if (mattes) plain.output.aovs = {Aov::crypto_object};
    JobSpec named = plain;
    named.scene.objects[0].name = "hero";
    Shop shop;
    shop.work(plain);
    EXPECT_EQ(shop.work(named).size(), static_cast<std::size_t>(mattes ? count_tasks(named) : 0));
  }
}

// A key that only later frames see leaves those before as they are.
TEST(Adoption, AKeyChangesTheFramesThatItMoves) {
  JobSpec job = moving_job(2, 8, 3);
  job.motion.curve = KeyCurve::linear;
  job.camera.keys = {{.frame = 1, .position = {0, 0, 5}, .look_at = {}, .up = {0, 1, 0}},
                     {.frame = 5, .position = {0, 1, 5}, .look_at = {}, .up = {0, 1, 0}},
                     {.frame = 8, .position = {0, 2, 5}, .look_at = {}, .up = {0, 1, 0}}};
  JobSpec other = job;
  other.camera.keys[2].position.x = 1;
  const ParsedJobDocument document = document_of(job), other_document = document_of(other);
  EXPECT_EQ(document.picture, other_document.picture);
  const FrameComparison comparison(document, other_document);
  EXPECT_EQ(comparison.num_common_steps(), 5);
  EXPECT_FALSE(comparison.are_equal(FrameIndex(5), FrameIndex(5)));
  EXPECT_EQ(comparison.difference(FrameIndex(5), FrameIndex(5)), "$.camera.keys at frame 6");
}

// Vectors of motion lead to the frame behind, and are seen only where both jobs have them.
TEST(Adoption, AKeyChangesTheMotionOfTheFrameBefore) {
  JobSpec job = moving_job(2, 8, 3);
  job.motion.curve = KeyCurve::linear;
  job.scene.objects = {{.mesh = "m", .material = "m"}};
  job.scene.objects[0].keys = {{.frame = 1}, {.frame = 6}, {.frame = 7}};
  JobSpec other = job;
  other.scene.objects[0].keys[2].translate.x = 1;
  const auto num_common = [&] {
    return FrameComparison(document_of(job), document_of(other)).num_common_steps();
  };
  EXPECT_EQ(num_common(), 6);
  job.output.aovs = {Aov::motion};
  EXPECT_EQ(num_common(), 6);
  other.output.aovs = {Aov::motion};
  EXPECT_EQ(num_common(), 5);
}

TEST(Adoption, ACarriedHistoryBeginsWithTheFirstFrame) {
  const JobSpec job = small_job(1, 8, 2);
  EXPECT_NE(document_of(job).picture, document_of(with_frames(job, 2, 8)).picture);
  JobSpec fresh = small_job(1, 8, 2, /*carry=*/false);
  EXPECT_EQ(document_of(fresh).picture, document_of(with_frames(fresh, 2, 8)).picture);
}

// Whichever of several former jobs wrote a frame, and at whatever place.
TEST(Adoption, AFrameThatIsKeptBringsWhatWasSeenOfIt) {
  const JobSpec job = small_job(1, 6, 2, false);
  const auto image_of = [](int number, FrameIndex place) {
    return BlobRef{BlobKind::image, place.value(), 0, digest_of(std::to_string(number)), 100};
  };
  const auto former = [&](int first, int last) {
    FormerJob made{document_of(with_frames(job, first, last)), {}, {}, JobStatus::done};
    for (FrameIndex place; place.index() < made.document.job.frames.size(); ++place) {
      const int number = made.document.job.frames[place.index()].value();
      made.tasks.push_back({assemble_task(place), {image_of(number, place)}});
      made.frames[place].position = place.value();
      made.frames[place].quality.cycles_noise = static_cast<float>(number);
    }
    return made;
  };
  // The newest has frame 6 from before, and nothing was told of it.
  FormerJob blind = former(5, 6);
  blind.frames.clear();
  const KeptFiles files{.has_frame =
                            [&](FrameIndex frame, const BlobRef& image) {
                              return image.digest ==
                                     image_of(job.frames[frame.index()].value(), frame).digest;
                            },
                        .has_blob = [](const BlobRef&) { return false; }};
  const Adoption adoption =
      adopt(document_of(job), {blind, former(1, 3), former(4, 5), former(5, 6)}, files);
  ASSERT_EQ(adoption.frames.size(), 6u);
  for (const Completion& frame : adoption.frames) {
    const int place = frame.task.frame().value();
    ASSERT_EQ(frame.made.frames.size(), 1u) << place;
    EXPECT_EQ(frame.made.frames[0].frame(), FrameIndex(place));
    EXPECT_EQ(frame.made.frames[0].quality.cycles_noise, static_cast<float>(place + 1));
    EXPECT_FALSE(JobGraph(job).check_frames(frame.task, frame.made.frames));
  }
}

}  // namespace
}  // namespace baton
