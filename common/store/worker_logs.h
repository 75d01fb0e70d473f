#pragma once

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>
#include <string_view>

namespace baton {

/// Where workers write what they log: in the work folder, beside the store.
inline std::filesystem::path worker_logs(const std::filesystem::path& work_folder) {
  return work_folder / "logs";
}

/// The log of a worker: the first 200 bytes of its name, in which all but letters, digits and "_#-"
/// becomes "_". A dot divides it from what is not of the name, as in "NAME.1.log".
inline std::filesystem::path worker_log(const std::filesystem::path& work_folder,
                                        std::string worker) {
  std::ranges::replace_if(
      worker,
      [](unsigned char c) {
        return std::isalnum(c) == 0 &&
               std::string_view("_#-").find(static_cast<char>(c)) == std::string_view::npos;
      },
      '_');
  constexpr std::size_t kMost = 200;
  return worker_logs(work_folder) / (worker.substr(0, kMost) + ".log");
}

/// Beside its log, what its threads did (common/base/trace.h).
inline std::filesystem::path trace_beside(std::filesystem::path worker_log) {
  return worker_log.replace_extension(".trace");
}

}  // namespace baton
