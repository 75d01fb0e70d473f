#include "jobs/cli/render/look_folder.h"

#include <fmt/format.h>

#include <string>
#include <system_error>

#include "common/base/bytes.h"
#include "common/base/files.h"

namespace baton {

Status claim_look_folder(const std::filesystem::path& folder, bool may_replace) {
  const std::filesystem::path mark = folder / ".baton-look";
  std::error_code error;
  if (std::filesystem::exists(mark, error)) return {};
  std::filesystem::create_directories(folder, error);
  bool is_empty = true;  // but for what Baton has put there for its work
  std::filesystem::directory_iterator files(folder, error);
  for (; !error && files != std::filesystem::directory_iterator(); files.increment(error))
    is_empty = is_empty && files->path().filename().string().starts_with(".baton");
  if (error) return Error{ErrorKind::io, fmt::format("{}: {}", folder.string(), error.message())};
  if (!is_empty && !may_replace) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: a look would replace what is in it, and no look has made that\n"
                             "--restart replaces it, --set output.directory=DIR keeps it",
                             folder.string())};
  }
  return write_file_atomic(
      mark, as_bytes_view("frames of looks: the next one may replace whatever is here\n"));
}

}  // namespace baton
