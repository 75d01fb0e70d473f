#include <fmt/format.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>

#include "common/base/build.h"
#include "common/base/command_pages.h"
#include "common/base/exit_codes.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/base/log.h"
#include "common/base/option_environment.h"
#include "common/base/option_values.h"
#include "common/base/settings.h"
#include "common/image/exr_check.h"
#include "coordinator/service/service.h"

namespace {

/// Set by SIGTERM and SIGINT, read by the loop.
std::atomic<bool> g_stop{false};

/// The first signal stops cleanly, a second one of the same kind ends the process at once.
void install_stop_handler() {
  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGINT, &action, nullptr);
}

/// Who is let in, and what may then be done.
void add_rights(CLI::App& app, baton::ServiceOptions& options, std::string& key_file,
                bool& insecure) {
  app.add_option(
         "--key", key_file,
         "server.key of `baton key create`; whoever it knows is let in. Without it, an address "
         "of this machine has keys of its own, which programs of this user find")
      ->envname("BATON_KEY");
  app.add_flag("--insecure", insecure,
               "listen without a key: whoever reaches the address may do everything");
  app.add_option("--root", options.roots,
                 "folder that jobs may read from and write to, may be repeated; needed where other "
                 "machines reach the coordinator; default elsewhere: all")
      ->envname("BATON_ROOT");
  app.add_option("--user-priority", options.user_priority,
                 "the highest priority that a user's key may give")
      ->check(CLI::Range(0, baton::limits::kMaxPriority))
      ->capture_default_str();
}

baton::Status coordinate(baton::ServiceOptions options, const std::string& key_file, bool insecure,
                         const std::filesystem::path& endpoint_file) {
  if (!baton::is_of_this_machine(options.listen) && options.roots.empty()) {
    return baton::Error{baton::ErrorKind::usage,
                        options.listen +
                            ": other machines reach it: --root FOLDER says where jobs may read and "
                            "write, and may be repeated; --root / allows all folders"};
  }
  BATON_ASSIGN(options.access,
               baton::server_access(key_file, insecure, options.listen, options.work_dir));
  BATON_ASSIGN(baton::Service service, baton::Service::open(options));
  const baton::OwnKeysNote note(service.endpoint(), options.access);
  if (!endpoint_file.empty()) {
    BATON_TRY(
        baton::write_file_atomic(endpoint_file, baton::as_bytes_view(service.endpoint() + "\n")));
  }
  spdlog::info("listening on {}, work folder {}", service.endpoint(), options.work_dir.string());
  return service.run(g_stop);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Splits jobs into tasks and leases them to workers. Killed at any time, it goes on where it "
      "was.",
      "baton-coordinator");
  app.set_version_flag("--version", baton::build_identity());
  app.footer(
      "Examples:\n"
      "  baton-coordinator --work-dir /srv/baton --listen 'tcp://*:5570' --key keys/server.key\n"
      "  baton-coordinator --work-dir farm --listen 'tcp://127.0.0.1:*' --endpoint-file "
      "farm/endpoint\n"
      "The work folder must be on a file system that all workers share.");

  app.parse_complete_callback([&app] {
    if (const std::string fault = baton::value_fault(app); !fault.empty())
      throw CLI::ValidationError(fault);
  });
  baton::ServiceOptions options;
  std::filesystem::path endpoint_file;
  std::int64_t heartbeat_ms = options.heartbeat.count();
  app.add_option("--listen", options.listen, "endpoint; port * picks a free one")
      ->envname("BATON_LISTEN")
      ->capture_default_str();
  app.add_option("--work-dir", options.work_dir, "folder of the journal and the blob store")
      ->envname("BATON_WORK_DIR")
      ->required();
  app.add_option("--endpoint-file", endpoint_file,
                 "file that gets the concrete endpoint once it listens");
  app.add_option("--heartbeat-ms", heartbeat_ms,
                 "between signs of life of a worker; it loses its leases when four are missing")
      ->check(CLI::Range(10, 60000))
      ->capture_default_str();
  app.add_flag(
      "--mixed-builds", options.mixed_builds,
      "take workers of other builds and instruction sets. Their pixels may differ; each frame "
      "is by one of them, which goes on while it is there");
  std::string key_file;
  bool insecure = false;
  add_rights(app, options, key_file, insecure);
  std::uint64_t store_limit_mib = 0;
  app.add_option("--store-limit", store_limit_mib,
                 "MiB that states and films may take in the work folder: jobs that would need more "
                 "wait; default: as the disk has room")
      ->envname("BATON_STORE_LIMIT")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1} << 40));
  baton::add_page_options<CLI::Success>(app);
  if (const auto settings = baton::take_settings(baton::describe_command(app)); !settings) {
    fmt::print(stderr, "{}\n", baton::legible_text(settings.error().message));
    return static_cast<int>(baton::exit_code_of(settings.error().kind));
  }
  try {
    baton::limit_environment(app, argc, argv);
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return baton::end_parsing(app, error);
  }

  baton::init_logging("baton-coordinator");
  install_stop_handler();
  options.heartbeat = std::chrono::milliseconds(heartbeat_ms);
  options.store_limit = store_limit_mib << 20;
  options.disk.picture_writer = baton::writer_of_frame;
  const baton::Status status = coordinate(options, key_file, insecure, endpoint_file);
  if (status) return static_cast<int>(baton::ExitCode::ok);
  spdlog::error("{}", status.error().message);
  return static_cast<int>(baton::exit_code_of(status.error().kind));
}
