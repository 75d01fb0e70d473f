#pragma once

#include <string>
#include <thread>
#include <vector>

#include "jobs/cli/asset_report.h"

namespace baton {

/// What a person should know before the job is rendered, one line each, in the order of the files:
/// maps that are black, of low dynamic range, not twice as wide as high, or with texels that count
/// as 0; dropped triangles; objects that no frame shows; light that jumps; a method that is known
/// to fail under it; AOVs that say nothing; an output folder that cannot be written or has too
/// little room. assets: of this job, with settled motion.
std::vector<std::string> job_warnings(const JobSpec& job, const AssetReport& assets);

/// Says on stderr what job_warnings says, while the job is rendered already: files are read by a
/// thread of its own, at most 16 of the maps. Files that cannot be loaded are left to the workers,
/// whose job then fails.
class WarningsAside {
 public:
  /// Construct it after SignalWait. job: with settled motion.
  explicit WarningsAside(JobSpec job);
  /// Waits for the thread.
  ~WarningsAside() = default;

 private:
  std::jthread thread_;
};

}  // namespace baton
