#include "jobs/cli/coordinator_link.h"

#include <fmt/core.h>

#include <cstdio>
#include <utility>

#include "jobs/cli/commands.h"
#include "jobs/cli/say.h"

namespace baton {

Result<RequestClient> CoordinatorLink::connect() const {
  BATON_ASSIGN(const ClientAccess access, client_access(key_file, insecure, endpoint));
  return RequestClient::connect(endpoint, access);
}

void add_coordinator_options(CLI::App& command, CoordinatorLink& link) {
  command.add_option("--coordinator", link.endpoint, "endpoint of the coordinator")
      ->envname("BATON_COORDINATOR")
      ->capture_default_str();
  command.add_option("--key", link.key_file, "user.key or admin.key of `baton key create`")
      ->envname("BATON_KEY");
  command.add_flag("--insecure", link.insecure, "connect without a key");
}

void print_pending(const RequestClient& client, std::set<std::string>& printed) {
  if (printed.insert(client.pending()).second) tell("{}\n", client.pending());
}

ExitCode finish_with_coordinator(const Result<ExitCode>& outcome) {
  const ExitCode code = finish(outcome);
  return !outcome && outcome.error().kind == ErrorKind::timeout ? ExitCode::unavailable : code;
}

}  // namespace baton
