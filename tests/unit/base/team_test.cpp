#include "common/base/team.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <set>
#include <thread>
#include <vector>

namespace baton {
namespace {

// Who waits for the turn does parts of what is made; each is done once, and the turn goes on only
// when all are.
TEST(Team, WaitersHelp) {
  constexpr std::size_t kParts = 64, kThreads = 4;
  Team team;
  std::vector<std::atomic<int>> done(kParts);
  std::atomic<std::size_t> num_helped = 0, num_waiting = 0;
  std::atomic<bool> is_made = false;
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < kThreads; ++i) {
    threads.emplace_back([&] {
      ++num_waiting;
      Team::Turn turn(team, "it");
      if (is_made) return;
      const std::thread::id maker = std::this_thread::get_id();
      // The others are at the door.
      while (num_waiting < kThreads) std::this_thread::yield();
      std::atomic<bool> has_helper = false;
      int patience_ms = 10000;  // of the maker alone
      turn.share(kParts, [&](std::size_t part) {
        ++done[part];
        if (std::this_thread::get_id() != maker) {
          ++num_helped;
          has_helper = true;
          return;
        }
        // The maker lets another do some.
        for (; patience_ms > 0 && !has_helper; --patience_ms)
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
      });
      for (const std::atomic<int>& times : done) EXPECT_EQ(times, 1);
      is_made = true;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(is_made);
  EXPECT_GT(num_helped, 0u);
}

TEST(Team, TurnsAreTakenByOneAtATime) {
  Team team;
  int inside = 0, most = 0, all = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int n = 0; n < 200; ++n) {
        Team::Turn turn(team, "it");
        most = std::max(most, ++inside);
        turn.share(3, [](std::size_t) {});
        turn.share(0, [](std::size_t) {});
        ++all;
        --inside;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(most, 1);
  EXPECT_EQ(all, 800);
}

}  // namespace
}  // namespace baton
