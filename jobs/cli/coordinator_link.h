#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <set>
#include <string>
#include <thread>
#include <variant>

#include "common/base/exit_codes.h"
#include "common/protocol/client.h"

namespace baton {

/// Which coordinator, and how to be let in.
struct CoordinatorLink {
  std::string endpoint = "tcp://127.0.0.1:5570";
  std::string key_file;
  bool insecure = false;

  Result<RequestClient> connect() const;
};

/// Adds --coordinator, --key and --insecure; the environment's BATON_COORDINATOR and BATON_KEY
/// stand in for the first two.
void add_coordinator_options(CLI::App& command, CoordinatorLink& link);

/// Of an option that names a job.
inline constexpr const char* kJobHelp = "job: its name, its ID, or the beginning of that";

/// Asks for an answer of type A. Errors: those of RequestClient::request; internal when another
/// type came.
template <class A>
Result<A> ask(RequestClient& client, const Message& question,
              std::chrono::milliseconds timeout = std::chrono::seconds(10)) {
  BATON_ASSIGN(Message answer, client.request(question, timeout));
  if (A* expected = std::get_if<A>(&answer)) return std::move(*expected);
  return Error{ErrorKind::internal,
               "the coordinator answered with another message than was asked for"};
}

/// Prints what the coordinator is doing before it can answer, each line once: a bad disk gives two
/// reasons by turns.
void print_pending(const RequestClient& client, std::set<std::string>& printed);

/// Like ask, and again for as long as the coordinator says that it is not done.
template <class A>
Result<A> ask_until_done(RequestClient& client, const Message& question) {
  std::set<std::string> printed;
  for (;;) {
    Result<A> answer = ask<A>(client, question);
    if (client.pending().empty()) return answer;
    print_pending(client, printed);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

/// Like finish (commands.h), but a timeout means that no coordinator answers.
ExitCode finish_with_coordinator(const Result<ExitCode>& outcome);

}  // namespace baton
