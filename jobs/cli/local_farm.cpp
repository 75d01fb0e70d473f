#include "jobs/cli/local_farm.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>
#include <thread>

#include "common/base/files.h"
#include "common/base/legible.h"
#include "common/base/limits.h"
#include "common/base/machine_memory.h"
#include "common/base/patience.h"

namespace baton {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr milliseconds kStartPatience{20000 * kPatienceFactor};
constexpr milliseconds kWorkerPatience{10000 * kPatienceFactor};
constexpr milliseconds kCoordinatorPatience{5000 * kPatienceFactor};
/// In a row, of a program that each time lived for less than kShortLife.
constexpr int kMaxRestarts = 5;
constexpr std::chrono::seconds kShortLife{60};

/// Why a program has ended, by its log; empty: that says nothing.
std::string last_line_of(const fs::path& log) {
  std::ifstream stream(log);
  std::string last;
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty()) last = line;
  }
  const std::size_t error = last.find("error: ");
  return legible_line(error == last.npos ? last : last.substr(error));
}

/// The share of one worker; there is one.
std::uint64_t memory_mib_of_each(const FarmOptions& options) {
  const std::uint64_t all =
      options.memory_bytes > 0 ? options.memory_bytes : default_memory_bytes();
  return std::max<std::uint64_t>(1, (all >> 20) / static_cast<std::uint64_t>(options.workers));
}

/// Programs append to their logs: one that has grown long goes on empty, and is kept once. No link
/// that stands in the place of either is followed.
void put_aside_long(const fs::path& log) {
  struct stat status {};
  if (::lstat(log.c_str(), &status) != 0 || !S_ISREG(status.st_mode) ||
      status.st_size <= static_cast<off_t>(limits::kMaxLogBytes))
    return;
  const FileDescriptor file(::open(log.c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC));
  const Result<Bytes> text = read_file(log, 8 * limits::kMaxLogBytes);
  const Status kept =
      text ? write_file_unsynced(log.string() + ".1", *text, 0600) : Status(text.error());
  const bool is_empty = kept && file && ::ftruncate(file.number(), 0) == 0;
  if (!is_empty && !kept) spdlog::warn("a log is not put aside: {}", kept.error().message);
}

/// Of a farm that was killed in this work folder.
void remove_left_socket(const fs::path& endpoint_file) {
  constexpr std::string_view kScheme = "ipc://";
  const Result<std::string> endpoint = read_text_file(endpoint_file, limits::kMaxTextLength);
  if (!endpoint || !endpoint->starts_with(kScheme)) return;
  PrivateFolder::remove_left(
      fs::path(endpoint->substr(kScheme.size(), endpoint->find('\n') - kScheme.size()))
          .parent_path());
}

}  // namespace

Result<FileDescriptor> LocalFarm::lock_directory(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot create: {}", directory.string(), error.message())};

  BATON_ASSIGN(std::optional<FileDescriptor> lock, try_lock_file(directory / "lock"));
  if (!lock) {
    return Error{ErrorKind::io,
                 fmt::format("{}: another `baton render` works here", directory.string())};
  }
  return std::move(*lock);
}

Result<LocalFarm> LocalFarm::start(const FarmOptions& options) {
  ::unsetenv("BATON_KEY");  // nobody else reaches this farm, and one key does not fit all
  BATON_ASSIGN(const std::string coordinator, sibling_program("baton-coordinator"));
  BATON_ASSIGN(const std::string worker, sibling_program("baton-worker"));
  BATON_ASSIGN(FileDescriptor lock, lock_directory(options.work_directory));
  remove_left_socket(options.work_directory / "endpoint");
  // A port goes to somebody else while a coordinator that died is started again, and is open to all
  // users of the machine; a socket in a folder of its own is neither.
  PrivateFolder folder;
  if (options.listen.empty()) {
    BATON_ASSIGN(folder, PrivateFolder::make());
  }
  LocalFarm farm(options, std::move(folder), std::move(lock));
  BATON_TRY(farm.start_coordinator(coordinator));
  for (int i = 1; i <= options.workers; ++i) {
    std::vector<std::string> command{worker,
                                     "--coordinator",
                                     farm.endpoint_,
                                     "--threads",
                                     std::to_string(options.threads_per_worker),
                                     "--memory",
                                     std::to_string(memory_mib_of_each(options))};
    if (!options.isa.empty()) command.insert(command.end(), {"--isa", options.isa});
    BATON_TRY(farm.add_member(fmt::format("worker-{}", i), std::move(command)));
  }
  return farm;
}

Status LocalFarm::start_coordinator(const std::string& program) {
  const fs::path endpoint_file = options_.work_directory / "endpoint";
  std::error_code error;
  fs::remove(endpoint_file, error);
  std::vector<std::string> command{program,
                                   "--listen",
                                   endpoint_,
                                   "--work-dir",
                                   options_.work_directory.string(),
                                   "--endpoint-file",
                                   endpoint_file.string()};
  // The keys of such a farm are those of its user, who may do what the account may.
  if (!options_.server_key.empty())
    command.insert(command.end(), {"--key", options_.server_key, "--root", "/"});
  if (options_.store_limit_mib > 0)
    command.insert(command.end(), {"--store-limit", std::to_string(options_.store_limit_mib)});
  BATON_TRY(add_member("coordinator", std::move(command)));

  // The file appears when the coordinator listens.
  const auto deadline = std::chrono::steady_clock::now() + kStartPatience;
  while (!fs::exists(endpoint_file, error)) {
    const std::optional<std::string> end = members_.front().process.ended();
    if (end || std::chrono::steady_clock::now() >= deadline) {
      return Error{ErrorKind::io, fmt::format("the coordinator did not start ({}); its log: {}",
                                              end.value_or("no endpoint in time"),
                                              log_of("coordinator").string())};
    }
    std::this_thread::sleep_for(milliseconds(10));
  }
  // Where a port was picked, a coordinator that is started again must have the same.
  if (options_.listen.empty()) return {};
  BATON_ASSIGN(endpoint_, read_text_file(endpoint_file, limits::kMaxTextLength));
  while (!endpoint_.empty() && endpoint_.back() == '\n') endpoint_.pop_back();
  members_.front().command.at(2) = endpoint_;
  return {};
}

Status LocalFarm::add_member(const std::string& name, std::vector<std::string> command) {
  BATON_ASSIGN(ChildProcess process, ChildProcess::start(command, log_of(name)));
  members_.push_back({name, std::move(command), std::move(process), 0});
  return {};
}

Status LocalFarm::tend() {
  for (Member& member : members_) {
    put_aside_long(log_of(member.name));
    const std::optional<std::string> end = member.process.ended();
    if (!end) continue;
    const std::string log = log_of(member.name).string();
    // Another try finds the same command line.
    if (*end == ChildProcess::kWrongUsage)
      return Error{ErrorKind::usage,
                   fmt::format("{} ended ({}): {}", member.name, *end, last_line_of(log))};
    const auto now = std::chrono::steady_clock::now();
    if (now - std::exchange(member.started, now) > kShortLife) member.restarts = 0;
    if (member.restarts == kMaxRestarts) {
      return Error{ErrorKind::io,
                   fmt::format("{} ended again, soon after {} restarts ({}); its log: {}",
                               member.name, kMaxRestarts, *end, log)};
    }
    ++member.restarts;
    spdlog::warn("{} ended ({}): started again, {} of {} times; its log: {}", member.name, *end,
                 member.restarts, kMaxRestarts, log);
    BATON_ASSIGN(member.process, ChildProcess::start(member.command, log));
  }
  return {};
}

void LocalFarm::stop() {
  const auto end_members = [&](std::size_t first, std::size_t last, milliseconds patience) {
    for (std::size_t i = first; i < last; ++i) members_[i].process.send_signal(SIGTERM);
    const auto deadline = std::chrono::steady_clock::now() + patience;
    for (std::size_t i = first; i < last; ++i) {
      const auto left =
          std::chrono::duration_cast<milliseconds>(deadline - std::chrono::steady_clock::now());
      if (!members_[i].process.wait_for_end(left)) members_[i].process.send_signal(SIGKILL);
    }
  };
  end_members(1, members_.size(), kWorkerPatience);
  end_members(0, std::min<std::size_t>(1, members_.size()), kCoordinatorPatience);
}

fs::path LocalFarm::log_of(const std::string& name) const {
  return options_.work_directory / (name + ".log");
}

}  // namespace baton
