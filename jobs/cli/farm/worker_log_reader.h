#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/job/job_id.h"

namespace baton {

/// What a worker logged.
struct WorkerLogLine {
  std::int64_t time_ms = 0;  ///< since 1970, UTC
  std::string worker;        ///< as its file is named
  std::string level;         ///< "info", "warning", ...
  std::string text;          ///< with its continuation lines
};

/// Reads what workers log about one job (common/store/worker_logs.h), as it comes: lines that begin
/// with "job" and the short ID: others may name files as they like.
class WorkerLogReader {
 public:
  WorkerLogReader(std::filesystem::path folder, const JobId& job)
      : folder_(std::move(folder)), wanted_("job " + job.short_hex() + ":") {}

  /// Whether the folder is seen from here.
  bool is_there() const;
  /// The lines that are new since the last call, in the order of time.
  std::vector<WorkerLogLine> read();

 private:
  void read_file(const std::filesystem::path& file, std::vector<WorkerLogLine>& lines);

  const std::filesystem::path folder_;
  const std::string wanted_;
  /// How far each file was read, by inode: a file that is put aside keeps that.
  std::map<std::uint64_t, std::uint64_t> read_bytes_;
};

}  // namespace baton
