#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <numeric>
#include <thread>

#include "jobs/trace/played_trace.h"
#include "jobs/trace/trace_file.h"
#include "jobs/trace/trace_summary.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::SizeIs;

/// A folder with the trace of a process.
struct TraceTest : testing::Test {
  fs::path folder =
      fs::path(testing::TempDir()) /
      (std::to_string(::getpid()) + testing::UnitTest::GetInstance()->current_test_info()->name());
  fs::path file = folder / "w.trace";

  void SetUp() override { fs::create_directories(folder); }
  void TearDown() override { fs::remove_all(folder); }

  void write(const std::string& text) { std::ofstream(file, std::ios::app) << text; }
  /// Times in seconds.
  void add(int thread, const char* kind, const std::string& name, double start, double seconds,
           const std::string& arguments = "", double waited = 0) {
    write(
        fmt::format("{{\"name\":\"{}\",\"cat\":\"{}\",\"ph\":\"X\",\"ts\":{},\"dur\":{},"
                    "\"tdur\":{},\"pid\":7,\"tid\":{},\"args\":{{{}}}}},\n",
                    name, kind, 1e6 * start, 1e6 * seconds,
                    std::string(kind) == "wait" ? 0 : 1e6 * (seconds - waited), thread, arguments));
  }
  /// A tile of one frame that takes so long, after its own state of the frame before; waited: of
  /// that its thread did nothing.
  void add_tile(int thread, int tile, int step, double start, double seconds, double waited = 0) {
    const std::string input = step == 0 ? "" : fmt::format("[0,{},{}]", step - 1, tile);
    add(thread, "task", "tile", start, seconds,
        fmt::format(R"("job":"v","id":"j","kind":"render","position":{},"tile":{},"first":{},)"
                    R"("last":{},"inputs":[{}])",
                    step, tile, step, step, input),
        waited);
    add(thread, "frame", "frame", start, seconds, fmt::format(R"("step":{})", step), waited);
  }
  Trace read() { return read_trace(file).value(); }
};

// Four tiles of three frames of a second each, on one thread: on four threads each tile goes its
// way, and more threads find nothing to do.
TEST_F(TraceTest, TasksArePlayedInTheOrderThatTheirInputsAllow) {
  for (int i = 0; i < 12; ++i) add_tile(1, i % 4, i / 4, i, 1);
  const PlayedTrace apart = take_apart(read());
  EXPECT_NEAR(apart.work_s(), 12, 1e-6);
  EXPECT_NEAR(play(apart, 1).seconds, 12, 1e-6);
  EXPECT_NEAR(play(apart, 3).seconds, 4, 1e-6);
  EXPECT_NEAR(play(apart, 4).seconds, 3, 1e-6);
  EXPECT_NEAR(play(apart, 16).seconds, 3, 1e-6);
  EXPECT_NEAR(play(apart, 16).busy, 4, 1e-6);
  EXPECT_EQ(play(apart, 16).chain_tasks, 3u);
}

// An assembly needs all tiles of its frame, and a report that comes late holds up who needs it.
TEST_F(TraceTest, AssembliesWaitForAllTilesAndForTheDisk) {
  add_tile(1, 0, 0, 0, 1);
  add_tile(1, 1, 0, 1, 2);
  add(2, "publish", "publish", 3, 0.5, R"("job":"v","kind":"render","position":0,"tile":1)");
  add(1, "task", "frame", 4, 1, R"("job":"v","id":"j","kind":"assemble","position":0,"step":0)");
  const PlayedTrace apart = take_apart(read());
  EXPECT_NEAR(play(apart, 2).seconds, 2 + 0.5 + 1, 1e-6);
  EXPECT_NEAR(play(apart, 2).chain_s.at("assemble"), 1, 1e-6);
}

// Light that one thread makes is waited for by the others, who help with its parts.
TEST_F(TraceTest, WhatIsMadeOnceIsWaitedForOrShared) {
  for (int thread = 0; thread < 4; ++thread) {
    add_tile(thread, thread, 0, 0, 3, thread == 0 ? 0 : 2);
    add(thread, thread == 0 ? "make" : "wait", "light of frame 1", 0, 2);
  }
  const PlayedTrace alone = take_apart(read());
  ASSERT_THAT(alone.works, SizeIs(1));
  EXPECT_NEAR(alone.work_s(), 2 + 4 * 1, 1e-6);
  EXPECT_NEAR(play(alone, 1).seconds, 6, 1e-6);
  EXPECT_NEAR(play(alone, 4).seconds, 3, 1e-6);
  EXPECT_NEAR(play(alone, 4).chain_waits_s.at("light of frame"), 2, 1e-6);
  // The same, of which all but a fifth is done in parts.
  add(0, "help", "light of frame 1", 0.4, 1.6);
  const PlayedTrace shared = take_apart(read());
  EXPECT_NEAR(shared.works[0].alone_s, 0.4, 1e-6);
  EXPECT_NEAR(shared.works[0].shared_s, 1.6, 1e-6);
  EXPECT_NEAR(play(shared, 1).seconds, 6, 1e-6);
  const Playback on_four = play(shared, 4);
  EXPECT_NEAR(on_four.seconds, 0.4 + 0.4 + 1, 1e-6);
  const std::vector<double>& busy = on_four.busy_over_time.threads;
  EXPECT_NEAR(std::accumulate(busy.begin(), busy.end(), 0.0) / BusyOverTime::kSlices, on_four.busy,
              1e-6);
  EXPECT_NEAR(busy.front(), 1, 1e-6) << "one makes what cannot be shared";
  EXPECT_NEAR(busy.back(), 4, 1e-6);
}

// Parts of an assembly go to threads that have nothing to do, whoever did them when it was
// recorded, and before any task.
TEST_F(TraceTest, WhatIsSharedIsDoneWithIdleThreads) {
  add_tile(1, 0, 0, 0, 1);
  add(1, "task", "frame", 1, 5, R"("job":"v","id":"j","kind":"assemble","position":0,"step":0)");
  add(1, "share", "tiles of step 0", 2, 3);
  for (int part = 0; part < 3; ++part) add(1, "help", "tiles of step 0", 2 + part, 1);
  add(2, "help", "tiles of step 0", 2, 1);
  add(2, "help", "tiles of step 1", 3, 1);  // of somebody else
  Trace trace = read();
  const PlayedTrace apart = take_apart(trace);
  EXPECT_NEAR(apart.work_s(), 1 + 5 + 1, 1e-6);
  EXPECT_NEAR(play(apart, 1).seconds, 7, 1e-6);
  EXPECT_NEAR(play(apart, 2).seconds, 1 + 2 + 2, 1e-6);
  EXPECT_NEAR(play(apart, 3).seconds, 1 + 2 + 2, 1e-6) << "four parts";
  EXPECT_NEAR(play(apart, 4).seconds, 1 + 2 + 1, 1e-6);
  add_tile(2, 1, 0, 0, 1);
  const TraceSummary summary = summarize(read(), {});
  EXPECT_EQ(summary.threads, 2u);
  EXPECT_NEAR(summary.busy * summary.seconds, 1 + 5 + 1 + 2, 1e-6);
}

// Of a task that was done again the last attempt counts, and none that came to nothing.
TEST_F(TraceTest, WhatWasLostIsLeftOut) {
  add_tile(1, 0, 0, 0, 5);
  add_tile(1, 0, 0, 5, 1);
  add(2, "task", "tile", 0, 9,
      R"("job":"v","kind":"render","position":0,"tile":1,"first":0,"last":0,"lost":"stopped")");
  EXPECT_NEAR(take_apart(read()).work_s(), 1, 1e-6);
}

// What a killed process has left does not hide what the next one says.
TEST_F(TraceTest, UnfinishedLinesAreSkippedAndJobsToldApart) {
  write("[\n");
  add_tile(1, 0, 0, 0, 1);
  write("{\"name\":\"cut");
  write("\n");
  write(R"({"name":"process_name","ph":"M","pid":7,"args":{"name":"w \"1\""}},)"
        "\n");
  add_tile(1, 1, 0, 1, 1);
  add(1, "task", "secret", 2, 1, R"("job":"u","id":"k","kind":"render","position":0,"tile":0)");
  add(1, "read", "/secret/file", 2.1, 0.1);
  Trace trace = read();
  EXPECT_THAT(trace.processes, testing::ElementsAre("w \"1\""));
  keep_job(trace, "j");
  const fs::path kept = folder / "kept.json";
  ASSERT_TRUE(write_trace(kept, trace).ok());
  std::ifstream stream(kept);
  const std::string text((std::istreambuf_iterator<char>(stream)), {});
  EXPECT_THAT(text, testing::Not(HasSubstr("secret")));
  EXPECT_THAT(text, HasSubstr("w \\\"1\\\""));
  const Trace again = read_trace(kept).value();
  EXPECT_NEAR(again.end_s(), 2, 1e-6) << "times from its start on";
  EXPECT_NEAR(take_apart(again).work_s(), 2, 1e-6);
  EXPECT_FALSE(read_trace(folder / "nothing").ok());
  std::ofstream(folder / "none.json") << "[]\n";
  EXPECT_THAT(read_trace(folder / "none.json").error().message, HasSubstr("expected a trace"));
}

// What this process records is what one reads.
TEST_F(TraceTest, SpansOfThreadsAreRecorded) {
  { const Span unseen(SpanKind::phase, "before"); }
  ASSERT_TRUE(trace_to_file(file, "the process").ok());
  name_traced_thread("main");
  {
    Span task(SpanKind::task, "a \"task\"\n");
    task.add("tile", 3);
    task.add("kind", "render");
    std::mutex mutex;
    std::unique_lock held(mutex);
    std::thread other([&] { const std::unique_lock late = lock_traced(mutex, "light"); });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    held.unlock();
    other.join();
    EXPECT_TRUE(lock_traced(mutex, "light").owns_lock());
  }
  end_trace();
  { const Span unseen(SpanKind::phase, "after"); }
  const Trace trace = read();
  ASSERT_THAT(trace.spans, SizeIs(2)) << "the task, and the wait of the other thread";
  EXPECT_EQ(trace.spans[0].task.tile, 3);
  EXPECT_EQ(trace.spans[0].name, "a \"task\"\\n");
  EXPECT_EQ(trace.spans[1].kind, SpanKind::wait);
  EXPECT_NE(trace.spans[0].thread, trace.spans[1].thread);
  EXPECT_LT(trace.spans[1].cpu_seconds, 0.5 * trace.spans[1].seconds);
  EXPECT_THAT(trace.processes, testing::ElementsAre("the process"));
}

TEST_F(TraceTest, ItsSummaryAddsUp) {
  for (int i = 0; i < 12; ++i) add_tile(i % 2, i % 4, i / 4, i / 2, 1);
  add(2, "phase", "start", -1, 1);
  add(2, "phase", "end", 6, 0.5);
  const TraceSummary summary = summarize(read(), {2});
  EXPECT_NEAR(summary.seconds, 7.5, 1e-6);
  EXPECT_NEAR(summary.lead_s, 1, 1e-6);
  EXPECT_NEAR(summary.tail_s, 0.5, 1e-6);
  EXPECT_EQ(summary.threads, 2u);
  EXPECT_NEAR(summary.busy, 12 / 7.5, 1e-6);
  EXPECT_NEAR(summary.played[0].second.seconds, summary.seconds, 1e-6);
  EXPECT_THAT(summary_text(summary), HasSubstr("played       2 threads: 7.50 s"));
}

}  // namespace
}  // namespace baton
