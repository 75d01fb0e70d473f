#include "coordinator/schedule/policy.h"

#include <gtest/gtest.h>

#include "coordinator/schedule/store_room.h"
#include "tests/unit/schedule/farm.h"

namespace baton {
namespace {

using namespace testing_farm;

/// Three workers and how they stand with a job that lets a worker rest after two failures.
struct PolicyTest : testing::Test {
  std::vector<std::string> connected{"a", "b", "c"};
  Standings standings;
  TimePoint now{};

  Crew crew() const { return {connected, standings, now}; }
  void fail_much(const std::string& worker) {
    for (int i = 0; i < 2; ++i) standings.add_failure(worker, 2, now);
  }
};

TEST_F(PolicyTest, AWorkerRestsWhileAnotherHasFailedLess) {
  standings.add_failure("a", 2, now);
  EXPECT_FALSE(rests(crew(), "a")) << "once is not much";
  standings.add_failure("a", 2, now);
  EXPECT_TRUE(rests(crew(), "a"));
  EXPECT_FALSE(rests(crew(), "b"));
  fail_much("b");
  standings.add_blind("c", "/shows", now);
  EXPECT_FALSE(rests(crew(), "a")) << "all would";
  EXPECT_TRUE(rests(crew(), "c")) << "who does not see the folders can do nothing";
}

TEST_F(PolicyTest, ARestEndsWithTimeOrAFreshStart) {
  fail_much("a");
  standings.add_blind("b", "/shows", now);
  now += Standings::kBlindRest - 1ms;
  EXPECT_TRUE(rests(crew(), "b"));
  now += 1ms;
  EXPECT_FALSE(rests(crew(), "b"));
  EXPECT_TRUE(rests(crew(), "a"));
  now = TimePoint{} + Standings::kWorkerRest;
  EXPECT_FALSE(rests(crew(), "a"));
  fail_much("a");
  standings.forget("a");
  EXPECT_FALSE(rests(crew(), "a"));
}

TEST_F(PolicyTest, ARetryGoesToWhoHasFailedTheTaskLeast) {
  const TaskBlame blame{{"a", {2, false}}, {"b", {1, false}}};
  EXPECT_FALSE(may_try(crew(), blame, "a"));
  EXPECT_FALSE(may_try(crew(), blame, "b")) << "c has not failed it";
  EXPECT_TRUE(may_try(crew(), blame, "c"));
  standings.add_blind("c", "/shows", now);
  EXPECT_TRUE(may_try(crew(), blame, "b")) << "c cannot";
  EXPECT_FALSE(may_try(crew(), blame, "a"));
  EXPECT_FALSE(may_try(crew(), {{"b", {1, true}}}, "b")) << "for good";
  EXPECT_FALSE(somebody_may_try({connected, standings, now},
                                {{"a", {1, true}}, {"b", {1, true}}, {"c", {1, true}}}));
}

TEST_F(PolicyTest, ATaskIsGivenUpWhenNobodyIsLeft) {
  const TaskBlame two{{"a", {1, false}}, {"b", {1, false}}};
  EXPECT_FALSE(is_exhausted(connected, two, /*max_retries=*/2));
  EXPECT_TRUE(is_exhausted(connected, two, 1)) << "as many workers as attempts";
  const TaskBlame one{{"a", {3, false}}};
  EXPECT_FALSE(is_exhausted(connected, one, 2)) << "b and c are there";
  connected = {"a"};
  EXPECT_TRUE(is_exhausted(connected, one, 2)) << "the only one has had all attempts";
  EXPECT_FALSE(is_exhausted(connected, {{"a", {1, false}}}, 2));
  EXPECT_TRUE(is_exhausted(connected, {{"a", {1, true}}}, 2)) << "the only one can do no more";
}

/// Two tiles, four frames in runs of two; a film takes 10 bytes and a state 20: a run makes 80, of
/// which 40 stay.
struct StoreRoomTest : testing::Test {
  JobSpec spec = small_job(2, 4, 2);
  JobGraph graph{spec};
  TaskBook book{graph};
  BlobSizes sizes{spec};
  TaskIndex first = *graph.find(render(0, 0)), later = *graph.find(render(1, 0));

  StoreRoomTest() {
    sizes.learn({{BlobKind::film, 0, 0, {}, 10}, {BlobKind::state, 1, 0, {}, 20}});
  }
  JobInStore fresh() const { return {spec, graph, book, sizes, baton::Run(0)}; }
  JobInStore begun() const { return {spec, graph, book, sizes, baton::Run(1)}; }
};

TEST_F(StoreRoomTest, ARunIsBegunWhenAllOfItFits) {
  EXPECT_EQ(unmade_bytes(fresh(), baton::Run(1)), 2u * (20 + 2 * 10));
  StoreRoom room{.limit = 80, .is_idle = false};
  EXPECT_EQ(room_for(room, fresh(), {}, first, Room::enough), Room::enough);
  EXPECT_EQ(room_for(room, fresh(), {}, first, Room::too_little), Room::too_little);
  room.is_idle = true;
  EXPECT_EQ(room_for(room, fresh(), {}, first, Room::too_little), Room::enough)
      << "nobody makes room";
  EXPECT_EQ(room_for(room, fresh(), {}, later, Room::enough), Room::too_little)
      << "with the first run";
  room.used = 1;
  EXPECT_EQ(room_for(room, fresh(), {}, first, Room::enough), Room::too_little)
      << "it would stand still with most of it";
  EXPECT_EQ(room_for({.limit = 81, .used = 1}, fresh(), {}, first, Room::enough), Room::enough);
  room.expected = 40;
  EXPECT_EQ(room_for(room, fresh(), {}, first, Room::enough), Room::too_little)
      << "nor does the task";
  EXPECT_EQ(room_for(room, fresh(), {}, *graph.find(assemble(0)), Room::enough), Room::enough);
}

TEST_F(StoreRoomTest, AJobIsBegunBesideOthersWhenAllCanEnd) {
  const std::vector others{begun()};
  // The states of both, a run, and an eighth.
  StoreRoom room{.limit = 181, .is_idle = false};
  EXPECT_EQ(room_for(room, fresh(), others, first, Room::enough), Room::beside);
  room.limit = 182;
  EXPECT_EQ(room_for(room, fresh(), others, first, Room::enough), Room::enough);
  EXPECT_EQ(room_for(room, fresh(), others, first, Room::beside), Room::beside)
      << "another one waits for that";
  EXPECT_EQ(room_for(room, begun(), {}, later, Room::beside), Room::enough);
  room.kept = room.used = 1;
  EXPECT_EQ(room_for(room, fresh(), others, first, Room::enough), Room::beside)
      << "of jobs that have ended";
  // The other one alone needs 120, more than the limit and an eighth.
  room = {.limit = 106, .used = 0, .is_idle = true};
  EXPECT_EQ(room_for(room, fresh(), others, first, Room::enough), Room::too_little)
      << "for its run, not for its end, which never comes";
  JobInStore paused = begun();
  paused.may_go_on = false;
  room = {.limit = 120, .is_idle = false};
  EXPECT_EQ(room_for(room, begun(), std::vector{paused}, first, Room::enough), Room::enough)
      << "it need not end now";
  EXPECT_EQ(room_for(room, begun(), others, first, Room::enough), Room::too_little);
  room = {.limit = 181, .is_idle = true};
  EXPECT_EQ(room_for(room, fresh(), std::vector{paused}, first, Room::enough), Room::beside)
      << "it is to end, too";
}

// A task makes 40 bytes. An eighth of 80 is 10.
TEST_F(StoreRoomTest, ARunThatWasBegunEndsThoughItsTilesAreLarger) {
  StoreRoom room{.limit = 80, .used = 10, .is_idle = true};
  EXPECT_EQ(room_for(room, begun(), {}, first, Room::enough), Room::enough);
  EXPECT_EQ(room_for(room, fresh(), {}, first, Room::enough), Room::too_little)
      << "nothing new is begun so";
  room.is_idle = false;
  EXPECT_EQ(room_for(room, begun(), {}, first, Room::enough), Room::enough);
  EXPECT_EQ(room_for(room, begun(), std::vector{begun()}, first, Room::enough), Room::too_little)
      << "others were begun, too";
  room = {.limit = 80, .used = 11, .is_idle = true};
  EXPECT_EQ(room_for(room, begun(), {}, first, Room::enough), Room::too_little)
      << "more than an eighth";
}

}  // namespace
}  // namespace baton
