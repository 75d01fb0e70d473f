#include "common/job/text/roots.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "common/base/paths.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

/// Without links and dots; empty: a part of it is a link that leads nowhere.
fs::path resolve(const fs::path& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error).lexically_normal();
  fs::path walked;
  for (const fs::path& part : absolute) {
    walked /= part;
    const bool is_link = fs::is_symlink(fs::symlink_status(walked, error));
    if (is_link && !fs::exists(walked, error)) return {};
  }
  const fs::path resolved = fs::weakly_canonical(path, error);
  return error ? fs::path() : resolved;
}

/// A path has no more parts: each is looked at.
constexpr std::ptrdiff_t kMaxParts = 128;

std::vector<fs::path> resolved(const Roots& roots) {
  std::vector<fs::path> folders;
  for (const fs::path& root : roots) {
    if (fs::path folder = resolve(root); !folder.empty()) folders.push_back(std::move(folder));
  }
  return folders;
}

/// folders: resolved.
bool is_below(const fs::path& path, const std::vector<fs::path>& folders) {
  if (std::distance(path.begin(), path.end()) > kMaxParts) return false;
  const fs::path found = resolve(path);
  return !found.empty() && std::ranges::any_of(folders, [&](const fs::path& folder) {
    return lies_in(found, folder);
  });
}

/// folders: the roots, resolved.
Status check_path(const fs::path& path, const char* what, const Roots& roots,
                  const std::vector<fs::path>& folders) {
  if (roots.empty() || is_below(path, folders)) return {};
  if (std::distance(path.begin(), path.end()) > kMaxParts)
    return Error{ErrorKind::bad_input, fmt::format("{} {}... has more than {} folders", what,
                                                   path.string().substr(0, 80), kMaxParts)};
  const fs::path found = resolve(path);
  const std::string leads = found == path.lexically_normal() ? ""
                            : found.empty()                  ? " (a link that leads nowhere)"
                                            : fmt::format(" (which is {})", found.string());
  std::vector<std::string> names;
  for (const fs::path& root : roots) names.push_back(root.string());
  return Error{ErrorKind::bad_input,
               fmt::format("{} {}{} lies outside what --root allows: {}", what, path.string(),
                           leads, fmt::join(names, ", "))};
}

}  // namespace

bool lies_within(const fs::path& path, const Roots& roots) {
  return roots.empty() || is_below(path, resolved(roots));
}

Status check_output_root(const JobSpec& job, const Roots& roots) {
  return check_path(job.output.directory, "output.directory", roots, resolved(roots));
}

Status check_roots(const ParsedJobDocument& document, const Roots& roots) {
  const std::vector<fs::path> folders = resolved(roots);
  BATON_TRY(check_path(document.job.output.directory, "output.directory", roots, folders));
  for (const AssetDigest& asset : document.assets)
    BATON_TRY(check_path(asset.path, "file", roots, folders));
  return {};
}

}  // namespace baton
