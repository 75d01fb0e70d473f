#include "worker/run/render_pool.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <semaphore>

namespace baton {
namespace {

LeaseId lease(std::int32_t tile) {
  return {.job = {}, .task = {TaskKind::render, 0, tile}, .attempt = 1, .epoch = 1};
}

PooledTask task(std::int32_t tile) {
  return {.lease = lease(tile), .inputs = {}, .job = nullptr, .store = nullptr};
}

/// Collects until `count` tasks have ended; each end releases `woken`.
std::vector<EndedTask> collect(RenderPool& pool, std::counting_semaphore<>& woken,
                               std::size_t count) {
  std::vector<EndedTask> all;
  while (all.size() < count) {
    for (EndedTask& ended : pool.collect()) all.push_back(std::move(ended));
    if (all.size() < count) woken.acquire();
  }
  return all;
}

TEST(RenderPool, RunsEverythingOnceAndWakesForEachResult) {
  std::counting_semaphore<> woken(0);
  RenderPool pool(
      3,
      [](const PooledTask& t, std::stop_token) {
        TaskOutput output;
        output.stats.pixels = static_cast<std::uint64_t>(t.lease.task.tile);
        return output;
      },
      [&] { woken.release(); });
  for (int tile = 0; tile < 50; ++tile) pool.submit(task(tile));
  std::vector<EndedTask> ended = collect(pool, woken, 50);

  std::sort(ended.begin(), ended.end(),
            [](const auto& a, const auto& b) { return a.lease < b.lease; });
  for (int tile = 0; tile < 50; ++tile) {
    EXPECT_EQ(ended[tile].lease, lease(tile));
    EXPECT_EQ(ended[tile].result->stats.pixels, std::uint64_t(tile));
  }
}

TEST(RenderPool, StopReachesTheRunningTaskAlone) {
  std::counting_semaphore<> woken(0), started(0), let_go(0);
  RenderPool pool(
      2,
      [&](const PooledTask&, std::stop_token stop) -> Result<TaskOutput> {
        started.release();
        let_go.acquire();
        if (stop.stop_requested()) return Error{ErrorKind::cancelled, "stopped"};
        return TaskOutput{};
      },
      [&] { woken.release(); });
  pool.submit(task(0));
  pool.submit(task(1));
  started.acquire();
  started.acquire();
  pool.stop(lease(1));
  let_go.release(2);
  for (const EndedTask& ended : collect(pool, woken, 2)) {
    EXPECT_EQ(ended.result.ok(), ended.lease == lease(0));
  }
}

TEST(RenderPool, DroppedTasksEndAsCancelledAndNeverRun) {
  std::counting_semaphore<> woken(0), started(0), let_go(0);
  RenderPool pool(
      1,
      [&](const PooledTask& t, std::stop_token) {
        EXPECT_EQ(t.lease, lease(0));
        started.release();
        let_go.acquire();
        return TaskOutput{};
      },
      [&] { woken.release(); });
  for (int tile = 0; tile < 3; ++tile) pool.submit(task(tile));
  started.acquire();
  pool.drop_queued();
  let_go.release();
  const std::vector<EndedTask> ended = collect(pool, woken, 3);
  EXPECT_EQ(std::count_if(ended.begin(), ended.end(), [](const auto& e) { return e.result.ok(); }),
            1);
}

TEST(RenderPool, ClosingStopsWhatRuns) {
  std::counting_semaphore<> started(0);
  RenderPool pool(
      1,
      [&](const PooledTask&, std::stop_token stop) -> Result<TaskOutput> {
        started.release();
        while (!stop.stop_requested()) std::this_thread::yield();
        return Error{ErrorKind::cancelled, "stopped"};
      },
      [] {});
  pool.submit(task(0));
  pool.submit(task(1));
  started.acquire();
}

}  // namespace
}  // namespace baton
