#include "coordinator/service/farm_document.h"

#include <filesystem>

namespace baton {

namespace fs = std::filesystem;

Result<ParsedJobDocument> parse_farm_document(std::string_view text) {
  BATON_ASSIGN(ParsedJobDocument document, parse_job_document(text));
  const fs::path folder = document.job.output.directory;
  if (!folder.has_filename()) document.job.output.directory = folder.parent_path().string();
  return document;
}

std::string resolve_folder(const std::string& folder) {
  std::error_code error;
  const fs::path resolved = fs::weakly_canonical(folder, error);
  return (error ? fs::path(folder).lexically_normal() : resolved).string();
}

Result<std::vector<Digest>> jobs_in_folder(Journal& journal, const std::string& folder,
                                           const std::optional<std::string>& name) {
  const std::string wanted = resolve_folder(folder);
  return journal.jobs_in([&](const std::string& known) { return resolve_folder(known) == wanted; },
                         name);
}

}  // namespace baton
