#pragma once

#include <set>
#include <string>
#include <vector>

#include "jobs/cli/check/asset_report.h"

namespace baton {

/// What a person should know before the job is rendered, one line each, in the order of the files:
/// maps that are black, of low dynamic range, not twice as wide as high, or with texels that count
/// as 0; dropped triangles; objects that no frame shows; light that jumps; a method that is known
/// to fail under it; AOVs that say nothing; an output folder that cannot be written or has too
/// little room. assets: of this job, with settled motion.
std::vector<std::string> job_warnings(const JobSpec& job, const AssetReport& assets);

/// Says on stderr what a person should know of a job that is rendered, each line once: what its
/// text tells at once, what its files tell as the workers find it (JobDetail::notes).
class WarningLog {
 public:
  /// job: with settled motion.
  void begin(const JobSpec& job);
  /// The lines that were not told yet; now they count as told. After 20 of them, as of the maps of
  /// a long sequence, one that says where the rest is told.
  std::vector<std::string> fresh(const std::vector<std::string>& lines);

 private:
  std::set<std::string> told_;
};

}  // namespace baton
