#include "coordinator/service/farm_document.h"

#include <filesystem>

namespace baton {

Result<ParsedJobDocument> parse_farm_document(std::string_view text) {
  BATON_ASSIGN(ParsedJobDocument document, parse_job_document(text));
  std::error_code error;
  std::filesystem::path folder =
      std::filesystem::weakly_canonical(document.job.output.directory, error);
  if (error) folder = std::filesystem::path(document.job.output.directory).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "frames/"
  document.job.output.directory = folder.string();
  return document;
}

}  // namespace baton
