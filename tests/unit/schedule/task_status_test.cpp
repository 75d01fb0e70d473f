#include <gtest/gtest.h>

#include <array>

#include "coordinator/schedule/task_status.h"

namespace baton {
namespace {

using S = TaskStatus;
constexpr std::optional<S> kNone;

// Rows: status; columns: inputs_done, input_lost, granted, completed, returned, exhausted,
// output_lost, cancelled.
constexpr std::array<std::array<std::optional<S>, 8>, 6> kTable{{
    /* blocked   */ {S::ready, kNone, kNone, kNone, kNone, kNone, kNone, S::cancelled},
    /* ready     */ {kNone, S::blocked, S::leased, kNone, kNone, kNone, kNone, S::cancelled},
    /* leased    */ {kNone, kNone, kNone, S::done, S::ready, S::failed, kNone, S::cancelled},
    /* done      */ {kNone, kNone, kNone, kNone, kNone, kNone, S::blocked, kNone},
    /* failed    */ {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone},
    /* cancelled */ {kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone},
}};

TEST(TaskStatus, EveryTransitionIsTheTables) {
  for (std::size_t status = 0; status < kTable.size(); ++status) {
    for (std::size_t event = 0; event < kTable[status].size(); ++event) {
      EXPECT_EQ(next_status(static_cast<S>(status), static_cast<TaskEvent>(event)),
                kTable[status][event])
          << "status " << status << ", event " << event;
    }
  }
}

}  // namespace
}  // namespace baton
