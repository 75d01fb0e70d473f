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

/// The log of a worker: the first 200 bytes of its name, in which all but letters, digits and
/// "._#-" becomes "_".
inline std::filesystem::path worker_log(const std::filesystem::path& work_folder,
                                        std::string worker) {
  std::ranges::replace_if(
      worker,
      [](unsigned char c) {
        return std::isalnum(c) == 0 &&
               std::string_view("._#-").find(static_cast<char>(c)) == std::string_view::npos;
      },
      '_');
  constexpr std::size_t kMost = 200;
  return worker_logs(work_folder) / (worker.substr(0, kMost) + ".log");
}

}  // namespace baton
