#include "coordinator/service/file_room.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <filesystem>
#include <system_error>

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

std::optional<std::string> lack_of_descriptors(const std::filesystem::path& list) {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return {};
  std::error_code error;
  std::filesystem::directory_iterator open(list, error);
  std::size_t count = 0;
  for (; !error && open != std::filesystem::directory_iterator(); open.increment(error)) ++count;
  // Where not even the list can be opened, none is left; any other error says nothing.
  const bool is_short =
      error == std::errc::too_many_files_open || error == std::errc::too_many_files_open_in_system;
  if (!is_short && (error || count + kReserve <= limit.rlim_cur)) return {};
  return fmt::format("{} file descriptors are all that the coordinator has (`ulimit -Hn`)",
                     limit.rlim_cur);
}

}  // namespace baton
