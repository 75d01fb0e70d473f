#include "common/base/private_folder.h"

#include <fmt/format.h>
#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace baton {

namespace fs = std::filesystem;

namespace {

constexpr const char* kPrefix = "baton-";

}  // namespace

Result<PrivateFolder> PrivateFolder::make() {
  constexpr std::size_t kMostBytes = 70;  // of the folder in which it is made
  std::error_code error;
  const char* const runtime = std::getenv("XDG_RUNTIME_DIR");
  const fs::path places[] = {runtime == nullptr ? "" : runtime, fs::temp_directory_path(error),
                             "/tmp"};
  std::string fault;
  for (const fs::path& place : places) {
    if (!place.is_absolute() || place.native().size() > kMostBytes) continue;
    std::string path = place / fmt::format("{}XXXXXX", kPrefix);
    if (::mkdtemp(path.data()) != nullptr) return PrivateFolder(path);
    fault = fmt::format("{}: cannot create a folder: {}", place.string(), std::strerror(errno));
  }
  return Error{ErrorKind::io, fault};
}

void PrivateFolder::remove_left(const fs::path& path) {
  if (!path.filename().string().starts_with(kPrefix)) return;
  std::error_code error;
  for (fs::directory_iterator file(path, error), end; !error && file != end;
       file.increment(error)) {
    std::error_code gone;
    if (file->is_socket(gone)) fs::remove(file->path(), gone);
  }
  fs::remove(path, error);  // not if something else is in it
}

PrivateFolder::~PrivateFolder() {
  if (!path_.empty()) remove_left(path_);
}

}  // namespace baton
