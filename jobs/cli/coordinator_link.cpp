#include "jobs/cli/coordinator_link.h"

#include "jobs/cli/commands.h"

namespace baton {

void add_coordinator_option(CLI::App& command, std::string& endpoint) {
  endpoint = "tcp://127.0.0.1:5570";
  command.add_option("--coordinator", endpoint, "endpoint of the coordinator")
      ->envname("BATON_COORDINATOR")
      ->capture_default_str();
}

ExitCode finish_with_coordinator(const Result<ExitCode>& outcome) {
  const ExitCode code = finish(outcome);
  return !outcome && outcome.error().kind == ErrorKind::timeout ? ExitCode::unavailable : code;
}

}  // namespace baton
