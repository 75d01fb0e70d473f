#pragma once

#include <chrono>
#include <optional>
#include <set>
#include <string>

#include "jobs/cli/coordinator_link.h"
#include "jobs/cli/local_farm.h"
#include "jobs/cli/signals.h"

namespace baton {

inline constexpr std::chrono::milliseconds kFarmPollInterval{200};

/// Asks until there is an answer, keeping the farm alive meanwhile: a coordinator that died comes
/// back, one that somebody else looks after within 5 min; one that says that it is not done may
/// take its time. nullopt when the user asked to stop.
template <class A>
Result<std::optional<A>> ask_farm(LocalFarm& farm, RequestClient& client, const SignalWait& signals,
                                  const Message& question) {
  constexpr std::chrono::milliseconds kAnswerPatience{2000};
  const auto patience = std::chrono::seconds(farm.is_own() ? 60 : 300);
  auto end = std::chrono::steady_clock::now() + patience;
  std::set<std::string> printed;
  for (;;) {
    Result<A> answer = ask<A>(client, question, kAnswerPatience);
    if (answer) return std::optional<A>(std::move(answer).value());
    if (!client.pending().empty()) {
      print_pending(client, printed);
      end = std::chrono::steady_clock::now() + patience;
    }
    if (answer.error().kind != ErrorKind::timeout || std::chrono::steady_clock::now() > end)
      return answer.error();
    if (signals.stop_requested_within(kFarmPollInterval)) return std::optional<A>();
    BATON_TRY(farm.tend());
  }
}

}  // namespace baton
