#include "worker/run/render_threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <semaphore>
#include <thread>

#include "tests/support/patience.h"

namespace baton {
namespace {

using namespace std::chrono_literals;

LeaseId lease(std::int32_t tile) {
  return {.job = {}, .task = {TaskKind::render, 0, tile}, .attempt = 1, .epoch = 1};
}

QueuedTask task(std::int32_t tile) {
  return {.grant = {.lease = lease(tile), .inputs = {}}, .job = nullptr, .store = nullptr};
}

Status at_once(std::span<const QueuedTask> /*tasks*/) { return {}; }

/// Collects until `count` tasks have ended; each end releases `woken`.
std::vector<TaskEnded> collect(RenderThreads& pool, std::counting_semaphore<>& woken,
                               std::size_t count) {
  std::vector<TaskEnded> all;
  while (all.size() < count) {
    for (TaskEnded& ended : pool.collect()) all.push_back(std::move(ended));
    if (all.size() < count) woken.acquire();
  }
  return all;
}

TEST(RenderThreads, RunsEverythingOnceAndWakesForEachResult) {
  std::counting_semaphore<> woken(0);
  RenderThreads pool(
      3,
      [](const QueuedTask& t, const std::stop_token&, std::vector<BlobRef>&) {
        TaskResult output;
        output.made.stats.pixels = static_cast<std::uint64_t>(t.grant.lease.task.tile);
        return output;
      },
      at_once, [&] { woken.release(); });
  for (int tile = 0; tile < 50; ++tile) pool.submit(task(tile));
  std::vector<TaskEnded> ended = collect(pool, woken, 50);

  std::sort(ended.begin(), ended.end(),
            [](const auto& a, const auto& b) { return a.lease < b.lease; });
  for (int tile = 0; tile < 50; ++tile) {
    EXPECT_EQ(ended[tile].lease, lease(tile));
    EXPECT_EQ(ended[tile].result->made.stats.pixels, std::uint64_t(tile));
  }
}

// A thread without a task helps one that shares what it does; where all have tasks none is lent.
TEST(RenderThreads, ThreadsWithoutATaskAreLent) {
  for (const int num_threads : {1, 3}) {
    SCOPED_TRACE(num_threads);
    constexpr std::size_t kParts = 64;
    std::vector<std::atomic<int>> done(kParts);
    std::atomic<std::size_t> num_helped = 0;
    std::counting_semaphore<> woken(0), helped(0);
    std::unique_ptr<RenderThreads> pool;
    const auto share = [&](const QueuedTask&, const std::stop_token&, std::vector<BlobRef>&) {
      const std::thread::id own = std::this_thread::get_id();
      // The other threads wait for a task by then.
      bool has_idle = num_threads == 1;
      while (!has_idle) has_idle = pool->lend([] {});
      share_parts([&](auto work) { return pool->lend(std::move(work)); }, "it", kParts,
                  [&](std::size_t part) {
                    ++done[part];
                    if (std::this_thread::get_id() != own) {
                      ++num_helped;
                      helped.release();
                    } else if (num_threads > 1 && num_helped == 0) {
                      static_cast<void>(helped.try_acquire_for(with_patience(10s)));
                    }
                  });
      return TaskResult{};
    };
    pool = std::make_unique<RenderThreads>(num_threads, share, at_once, [&] { woken.release(); });
    pool->submit(task(0));
    collect(*pool, woken, 1);
    for (const std::atomic<int>& times : done) EXPECT_EQ(times, 1);
    EXPECT_EQ(num_helped > 0, num_threads > 1);
  }
}

TEST(RenderThreads, StopReachesTheRunningTaskAlone) {
  std::counting_semaphore<> woken(0), started(0), let_go(0);
  RenderThreads pool(
      2,
      [&](const QueuedTask&, const std::stop_token& stop,
          std::vector<BlobRef>&) -> Result<TaskResult> {
        started.release();
        let_go.acquire();
        if (stop.stop_requested()) return Error{ErrorKind::cancelled, "stopped"};
        return TaskResult{};
      },
      at_once, [&] { woken.release(); });
  pool.submit(task(0));
  pool.submit(task(1));
  started.acquire();
  started.acquire();
  pool.stop(lease(1));
  let_go.release(2);
  for (const TaskEnded& ended : collect(pool, woken, 2)) {
    EXPECT_EQ(ended.result.ok(), ended.lease == lease(0));
  }
}

TEST(RenderThreads, DroppedTasksEndAsCancelledAndNeverRun) {
  std::counting_semaphore<> woken(0), started(0), let_go(0);
  RenderThreads pool(
      1,
      [&](const QueuedTask& t, const std::stop_token&, std::vector<BlobRef>&) {
        EXPECT_EQ(t.grant.lease, lease(0));
        started.release();
        let_go.acquire();
        return TaskResult{};
      },
      at_once, [&] { woken.release(); });
  for (int tile = 0; tile < 3; ++tile) pool.submit(task(tile));
  started.acquire();
  pool.drop_queued();
  let_go.release();
  const std::vector<TaskEnded> ended = collect(pool, woken, 3);
  EXPECT_EQ(std::count_if(ended.begin(), ended.end(), [](const auto& e) { return e.result.ok(); }),
            1);
}

// A pool of one thread and a disk that takes its time: the thread goes on, nothing counts as ended
// before it is on the disk, and what came up meanwhile shares the next wait.
TEST(RenderThreads, NoThreadWaitsForTheDisk) {
  std::counting_semaphore<> woken(0), waiting(0), let_go(0);
  std::vector<std::size_t> waits;
  RenderThreads pool(
      1,
      [](const QueuedTask&, const std::stop_token&, std::vector<BlobRef>&) { return TaskResult{}; },
      [&](std::span<const QueuedTask> tasks) {
        waits.push_back(tasks.size());
        waiting.release();
        let_go.acquire();
        return Status();
      },
      [&] { woken.release(); });
  pool.submit(task(0));
  waiting.acquire();
  for (int tile = 1; tile < 4; ++tile) pool.submit(task(tile));
  std::size_t left_thread = 0;
  while (left_thread < 4 && woken.try_acquire_for(with_patience(10s))) {
    left_thread += pool.take_executed().size();
  }
  EXPECT_EQ(left_thread, 4u);
  EXPECT_TRUE(pool.collect().empty());
  let_go.release(8);  // more than there are waits
  EXPECT_EQ(collect(pool, woken, 4).size(), 4u);
  EXPECT_EQ(waits, (std::vector<std::size_t>{1, 3}));
}

TEST(RenderThreads, WhatTheDiskRefusesHasFailed) {
  std::counting_semaphore<> woken(0);
  RenderThreads pool(
      1,
      [](const QueuedTask&, const std::stop_token&, std::vector<BlobRef>&) {
        return TaskResult{{{{BlobKind::film, 0, 0, digest_of("film"), 10}}}};
      },
      [](std::span<const QueuedTask>) {
        return Status(Error{ErrorKind::io, "disk full"});
      },
      [&] { woken.release(); });
  pool.submit(task(0));
  const std::vector<TaskEnded> ended = collect(pool, woken, 1);
  ASSERT_FALSE(ended[0].result);
  EXPECT_EQ(ended[0].result.error().message, "disk full");
  EXPECT_EQ(ended[0].left.size(), 1u);
}

TEST(RenderThreads, ClosingStopsWhatRuns) {
  std::counting_semaphore<> started(0);
  RenderThreads pool(
      1,
      [&](const QueuedTask&, const std::stop_token& stop,
          std::vector<BlobRef>&) -> Result<TaskResult> {
        started.release();
        while (!stop.stop_requested()) std::this_thread::yield();
        return Error{ErrorKind::cancelled, "stopped"};
      },
      at_once, [] {});
  pool.submit(task(0));
  pool.submit(task(1));
  started.acquire();
}

}  // namespace
}  // namespace baton
