#pragma once

#include <chrono>
#include <optional>

#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/local_farm.h"
#include "jobs/cli/signals.h"

namespace baton {

inline constexpr std::chrono::milliseconds kFarmPollInterval{200};

/// Asks until there is an answer, keeping the farm alive meanwhile: a coordinator that died comes
/// back. nullopt when the user asked to stop.
template <class A>
Result<std::optional<A>> ask_farm(LocalFarm& farm, RequestClient& client, const SignalWait& signals,
                                  const Message& question) {
  constexpr std::chrono::milliseconds kAnswerPatience{2000};
  constexpr int kMaxSilentPolls = 30;
  for (int silent = 0;; ++silent) {
    Result<A> answer = ask<A>(client, question, kAnswerPatience);
    if (answer) return std::optional<A>(std::move(answer).value());
    if (answer.error().kind != ErrorKind::timeout || silent == kMaxSilentPolls)
      return answer.error();
    if (signals.stop_requested_within(kFarmPollInterval)) return std::optional<A>();
    BATON_TRY(farm.tend());
  }
}

}  // namespace baton
