#include "worker/run/task_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

namespace baton {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr TaskWatch::TimePoint kStart{};

LeaseId watched_lease(std::int32_t tile) {
  return {Digest{1, 2}, {TaskKind::render, 0, tile}, 1, 1};
}

TEST(TaskWatch, ATaskPastItsDeadlineIsNamedOnce) {
  TaskWatch watch;
  const TaskWatch::Mark quick(watch, watched_lease(1), kStart + 10s);
  const TaskWatch::Mark slow(watch, watched_lease(2), kStart + 20s, "replay it");
  EXPECT_THAT(watch.take_overdue(kStart + 10s), IsEmpty());
  EXPECT_THAT(watch.take_overdue(kStart + 11s),
              ElementsAre(TaskWatch::Overdue{watched_lease(1), {}}));
  EXPECT_THAT(watch.take_overdue(kStart + 12s), IsEmpty());
  EXPECT_THAT(watch.take_overdue(kStart + 21s),
              ElementsAre(TaskWatch::Overdue{watched_lease(2), "replay it"}));
}

TEST(TaskWatch, ATaskThatEndedIsForgotten) {
  TaskWatch watch;
  std::optional<TaskWatch::Mark> mark;
  mark.emplace(watch, watched_lease(1), kStart + 10s);
  mark.reset();
  EXPECT_THAT(watch.take_overdue(kStart + 1h), IsEmpty());
  EXPECT_FALSE(watch.is_stuck(kStart + 1h));
}

TEST(TaskWatch, ATaskThatDoesNotStopIsStuckWhenPatienceEnds) {
  TaskWatch watch;
  const TaskWatch::Mark mark(watch, watched_lease(1), kStart + 10s);
  EXPECT_FALSE(watch.is_stuck(kStart + 10s + TaskWatch::kStopPatience));
  EXPECT_TRUE(watch.is_stuck(kStart + 11s + TaskWatch::kStopPatience));
}

}  // namespace
}  // namespace baton
