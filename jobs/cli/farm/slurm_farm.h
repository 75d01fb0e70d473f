#pragma once

#include <chrono>
#include <deque>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "common/protocol/client.h"
#include "common/protocol/messages.h"
#include "jobs/slurm/slurm_text.h"

namespace baton {

struct SlurmFarmOptions {
  PilotJob pilot;
  NodeRange nodes;
  /// Where the script of the pilots is written.
  std::filesystem::path script;
  std::chrono::milliseconds poll{10000};  ///< between two questions to Slurm
};

/// The pilots of one coordinator. Holds nothing that a successor would miss: what there is, Slurm
/// and the coordinator say; what should be, follows from that.
class SlurmFarm {
 public:
  explicit SlurmFarm(SlurmFarmOptions options) : options_(std::move(options)) {}

  /// Writes the script. Error: the disk, a folder of logs that Slurm cannot take.
  Status prepare() const;
  /// Looks and gives orders, when it is time to. client: of an admin. Where Slurm or the
  /// coordinator do not answer nothing happens but a warning: they may next time.
  void tend(RequestClient& client);
  /// Cancels all pilots.
  void cancel_all();

 private:
  using Clock = std::chrono::steady_clock;

  SlurmSnapshot observe(const JobList& list, std::vector<SlurmPilot> pilots, Clock::time_point now);
  void carry_out(const SlurmOrders& orders, RequestClient& client);
  void submit(int count);
  void warn_of_vain_arrays(const SlurmSnapshot& now);
  void warn_of_short_time(const JobList& list);
  void warn(const std::string& text);

  SlurmFarmOptions options_;
  Clock::time_point next_{};
  std::deque<std::uint64_t> tasks_;  ///< that could be in work, at the last looks
  std::map<std::string, Clock::time_point> alone_since_;  ///< running pilots, no worker
  std::set<std::string> told_to_end_;                     ///< workers
  int threads_per_pilot_ = 1;                             ///< as last seen
  VainArrays vain_;
  Clock::time_point submitted_{};  ///< last
  bool told_short_time_ = false;
  std::string last_warning_;
};

/// The pilots of a farm: Slurm's view, or why there is none.
Result<std::vector<SlurmPilot>> find_pilots(const std::string& job_name);

}  // namespace baton
