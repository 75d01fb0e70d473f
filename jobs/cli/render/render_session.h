#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "common/protocol/messages.h"
#include "jobs/cli/ask_farm.h"
#include "jobs/cli/check/job_warnings.h"
#include "jobs/cli/display.h"
#include "jobs/cli/job_argument.h"

namespace baton {

struct RenderOptions {
  JobArgument job;
  /// 0: one, whose threads share scene and light.
  int workers = 0;
  std::string isa;                    ///< empty: as the environment says
  int threads_per_worker = 0;         ///< 0: the processors shared out
  std::uint64_t memory_mib = 0;       ///< for all workers; 0: half of all
  std::string work_directory;         ///< empty: .baton in the output folder
  std::uint64_t store_limit_mib = 0;  ///< 0: as the disk has room
  std::string out;                    ///< the only frame as PNG; empty: none
  DisplayOptions display;             ///< the sheet and `out`
  bool watch = false;
  bool restart = false;
  std::optional<FrameNumber> from_frame;
  bool keep_running = false;
  std::string trace;  ///< for what threads did; empty: none
  bool json = false;
};

/// The farm that `options` ask for, with its folder in that of the job.
FarmOptions farm_options(const RenderOptions& options, const JobSpec& job);

/// --store-limit, of the coordinator that the command starts.
void add_store_limit_option(CLI::App& command, std::uint64_t& store_limit_mib);

/// --out shows one frame. Error: the job has more.
Status check_out(const RenderOptions& options, const JobSpec& job);

/// A farm of this machine that renders one job after another for `baton render`.
class RenderSession {
 public:
  /// options and signals must outlive the session.
  static Result<RenderSession> start(const RenderOptions& options, const FarmOptions& farm,
                                     const SignalWait& signals);
  /// The same with a farm that is there.
  RenderSession(const RenderOptions& options, const SignalWait& signals, LocalFarm farm,
                RequestClient client)
      : options_(options), signals_(signals), farm_(std::move(farm)), client_(std::move(client)) {}

  /// Renders a job whose motion and method are settled, with the sweeps that its quality asks for,
  /// shows how it gets on, and prints what came of it. A job that the farm has goes on
  /// where it stopped. `interrupted` is asked now and then; nullopt when it says so, or when the
  /// user asked to stop. An error, io, of a job that has failed since frames are not what it has
  /// written.
  Result<std::optional<JobStatus>> render(
      JobSpec job, bool restart, const std::function<bool()>& interrupted = [] { return false; });
  /// Keeps the farm up until the user asks to stop. `meanwhile` is called now and then.
  Status keep_running(const std::function<void()>& meanwhile = [] {});
  /// As LocalFarm's.
  const std::string& endpoint() const { return farm_.endpoint(); }
  Status tend() { return farm_.tend(); }
  void stop();

 private:
  Status await_worker();
  Status end_namesakes(const JobSpec& job);
  Result<std::optional<ShownJob>> render_document(const JobSpec& job, bool restart,
                                                  class FrameSheet& sheet,
                                                  const std::function<bool()>& interrupted);
  Result<std::optional<ShownJob>> follow(const JobSpec& spec, const JobId& job,
                                         class FrameSheet& sheet,
                                         const std::function<bool()>& interrupted);
  Status write_png_of(const JobSpec& job) const;

  const RenderOptions& options_;
  const SignalWait& signals_;
  LocalFarm farm_;
  RequestClient client_;
  WarningLog warnings_;
};

}  // namespace baton
