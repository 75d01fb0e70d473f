#include <fmt/format.h>

#include <memory>

#include "common/protocol/keys.h"
#include "jobs/cli/choice_option.h"
#include "jobs/cli/commands.h"
#include "jobs/cli/say.h"

namespace baton {
namespace {

struct KeyOptions {
  std::string folder;
  Speaker speaker{Role::user, ""};
};

Result<ExitCode> create(const KeyOptions& options) {
  BATON_TRY(create_keys(options.folder));
  say("{0}/server.key   for baton-coordinator\n{0}/worker.key   for every baton-worker\n"
      "{0}/viewer.key   for `baton`: looks only\n"
      "{0}/user.key     for `baton`: submits jobs and looks after its own\n"
      "{0}/admin.key    for `baton`: everything\n",
      options.folder);
  return ExitCode::ok;
}

Result<ExitCode> add(const KeyOptions& options) {
  BATON_TRY(add_key(options.folder, options.speaker));
  say("{}/{}.key   {}\n", options.folder, options.speaker.name, role_name(options.speaker.role));
  return ExitCode::ok;
}

}  // namespace

void add_key_command(CLI::App& app, ExitCode& code) {
  auto options = std::make_shared<KeyOptions>();
  CLI::App* key = app.add_subcommand("key", "Makes keys for a farm of several machines");
  key->require_subcommand(1);
  key->footer(
      "Examples:\n"
      "  baton key create keys                  server.key, and a key of each role\n"
      "  baton key add keys anna --role user    anna.key\n"
      "A coordinator lets in the keys that its server.key lists: it reads that again when it "
      "changes.");
  CLI::App* made =
      key->add_subcommand("create", "Keys of a coordinator, its workers and its users");
  CLI::App* added = key->add_subcommand("add", "One more key, with a name of its own");
  for (CLI::App* command : {made, added})
    command->add_option("FOLDER", options->folder, "where the keys are kept")->required();
  added->add_option("NAME", options->speaker.name, "whose key it is")->required();
  add_choice_option<Role>(*added, "--role", options->speaker.role,
                          {{"worker", Role::worker},
                           {"viewer", Role::viewer},
                           {"user", Role::user},
                           {"admin", Role::admin}},
                          "worker, viewer, user or admin")
      ->option_text("ROLE=user");
  made->callback([options, &code] { code = finish(create(*options)); });
  added->callback([options, &code] { code = finish(add(*options)); });
}

}  // namespace baton
