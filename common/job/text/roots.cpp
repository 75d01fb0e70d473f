#include "common/job/text/roots.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

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

Status check_path(const fs::path& path, const char* what, const Roots& roots) {
  if (lies_within(path, roots)) return {};
  const fs::path resolved = resolve(path);
  const std::string leads = resolved == path.lexically_normal() ? ""
                            : resolved.empty()                  ? " (a link that leads nowhere)"
                                               : fmt::format(" (which is {})", resolved.string());
  std::vector<std::string> names;
  for (const fs::path& root : roots) names.push_back(root.string());
  return Error{ErrorKind::bad_input,
               fmt::format("{} {}{} lies outside what this farm allows (--root): {}", what,
                           path.string(), leads, fmt::join(names, ", "))};
}

}  // namespace

bool lies_within(const fs::path& path, const Roots& roots) {
  if (roots.empty()) return true;
  const fs::path resolved = resolve(path);
  return !resolved.empty() && std::any_of(roots.begin(), roots.end(), [&](const fs::path& root) {
    const fs::path folder = resolve(root);
    if (folder.empty()) return false;
    return std::mismatch(folder.begin(), folder.end(), resolved.begin(), resolved.end()).first ==
           folder.end();
  });
}

Status check_output_root(const JobSpec& job, const Roots& roots) {
  return check_path(job.output.directory, "output.directory", roots);
}

Status check_roots(const ParsedJobDocument& document, const Roots& roots) {
  BATON_TRY(check_output_root(document.job, roots));
  for (const AssetDigest& asset : document.assets) BATON_TRY(check_path(asset.path, "file", roots));
  return {};
}

}  // namespace baton
