#include "coordinator/service/file_room.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <filesystem>

namespace baton {
namespace {

/// Left to clients, the journal and files that are read.
constexpr std::size_t kReserve = 16;

}  // namespace

void raise_file_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

std::optional<std::string> lack_of_descriptors() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  // Where not even the list can be read, none is left.
  std::error_code error;
  std::filesystem::directory_iterator open("/proc/self/fd", error);
  std::size_t count = 0;
  for (; !error && open != std::filesystem::directory_iterator(); open.increment(error)) ++count;
  if (!error && count + kReserve <= limit.rlim_cur) return {};
  return fmt::format("{} file descriptors are all that the coordinator has (`ulimit -Hn`)",
                     limit.rlim_cur);
}

}  // namespace baton
