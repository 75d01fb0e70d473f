#include "jobs/cli/look_folder.h"

#include <fmt/format.h>

#include <string>
#include <system_error>

#include "common/base/bytes.h"
#include "common/base/files.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

fs::path mark_of(const fs::path& folder) { return folder / ".baton-look"; }

bool is_look_folder(const fs::path& folder) {
  std::error_code error;
  return fs::exists(mark_of(folder), error);
}

/// Whether nothing is in it but what Baton has put there for its work. Makes the folder.
Result<bool> has_nothing(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  bool nothing = true;
  for (fs::directory_iterator file(folder, error), end; !error && file != end;
       file.increment(error))
    nothing = nothing && file->path().filename().string().starts_with(".baton");
  if (error) return Error{ErrorKind::io, fmt::format("{}: {}", folder.string(), error.message())};
  return nothing;
}

Status mark(const fs::path& folder) {
  return write_file_atomic(
      mark_of(folder),
      as_bytes_view("frames of looks: the next one may replace whatever is here\n"));
}

}  // namespace

Status claim_look_folder(const fs::path& folder, std::string_view way_on) {
  if (is_look_folder(folder)) return {};
  BATON_ASSIGN(const bool may, has_nothing(folder));
  if (may) return mark(folder);
  return Error{
      ErrorKind::bad_input,
      fmt::format("{}: what is in it would be replaced, and no look or comparison has made "
                  "that\n{}",
                  folder.string(), way_on)};
}

Status claim_output(const WantedJob& wanted, bool restart) {
  const fs::path folder = wanted.job.output.directory;
  if (!wanted.is_look) {
    if (!is_look_folder(folder)) return {};
    return Error{
        ErrorKind::bad_input,
        fmt::format("{}: looks or comparisons have made it, and the next one would replace "
                    "the job's frames: another output.directory keeps them",
                    folder.string())};
  }
  if (!restart)
    return claim_look_folder(folder, "--restart replaces it, --set output.directory=DIR keeps it");
  BATON_TRY(has_nothing(folder));
  return mark(folder);
}

}  // namespace baton
