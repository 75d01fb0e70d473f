#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/base/private_folder.h"
#include "common/base/result.h"
#include "jobs/cli/child_process.h"

namespace baton {

struct FarmOptions {
  int workers = 1;
  int threads_per_worker = 1;
  /// Memory of all workers together; 0: default_memory_bytes().
  std::uint64_t memory_bytes = 0;
  /// Journal, blobs, logs; what a resume needs.
  std::filesystem::path work_directory;
  /// Where the coordinator listens; empty: where only this user reaches it.
  std::string listen = {};
  /// File of the coordinator's key; empty: none.
  std::string server_key = {};
  std::uint64_t store_limit_mib = 0;  ///< limit of its store; 0: none
  /// Instruction set of the workers; empty: as the environment says.
  std::string isa = {};
};

/// A coordinator and workers on this machine, as child processes, at an address of their own that
/// only this user reaches. A program that dies is started again: the coordinator goes on from its
/// journal on the same endpoint, a worker's lost work is done again.
class LocalFarm {
 public:
  /// Starts everything and waits until the coordinator listens. Errors: the work directory cannot
  /// be made or belongs to a farm that runs; a program is missing; the coordinator does not come up
  /// (its log is named).
  static Result<LocalFarm> start(const FarmOptions& options);

  /// The farm of a coordinator that somebody else looks after: it has no programs to tend.
  static LocalFarm attach(const std::string& endpoint) {
    FarmOptions options;
    options.listen = endpoint;
    return {std::move(options), {}, FileDescriptor(-1)};
  }

  /// Replaces programs that have ended, with a warning. Error: one has ended too often, each time
  /// soon after its start.
  Status tend();
  /// Ends the workers, which finish what they hold, then the coordinator; kills what takes too
  /// long.
  void stop();

  /// Whether it is this process's, and nobody else looks after it.
  bool is_own() const { return !members_.empty(); }
  const std::string& endpoint() const { return endpoint_; }

 private:
  struct Member {
    std::string name;
    std::vector<std::string> command;
    ChildProcess process;
    int restarts = 0;
    std::chrono::steady_clock::time_point started = std::chrono::steady_clock::now();
  };

  LocalFarm(FarmOptions options, PrivateFolder folder, FileDescriptor lock)
      : options_(std::move(options)),
        folder_(std::move(folder)),
        endpoint_(options_.listen.empty() ? "ipc://" + (folder_.path() / "farm").string()
                                          : options_.listen),
        lock_(std::move(lock)) {}
  static Result<FileDescriptor> lock_directory(const std::filesystem::path& directory);
  Status start_coordinator(const std::string& program);
  Status add_member(const std::string& name, std::vector<std::string> command);
  std::filesystem::path log_of(const std::string& name) const;

  FarmOptions options_;
  /// Of the socket; none where another address is listened at.
  PrivateFolder folder_;
  std::string endpoint_;
  /// Holds the work directory as long as it is open.
  FileDescriptor lock_;
  std::vector<Member> members_;  ///< the coordinator first
};

}  // namespace baton
