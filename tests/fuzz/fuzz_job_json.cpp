#include "common/job/plan/estimate.h"
#include "common/job/text/job_json.h"
#include "common/job/text/picture.h"
#include "coordinator/schedule/job_graph.h"
#include "tests/fuzz/fuzz_target.h"

namespace baton {
namespace {

/// What `baton check` does with a job file, less its assets.
void look_at_job(std::string_view text) {
  const Result<JobSpec> job = parse_job(text, "job.json", "/no/folder");
  if (!job) return;
  const Result<JobSpec> again = parse_job(to_json(*job), "again.json", "/");
  BATON_CHECK(again.ok());
  BATON_CHECK(*again == *job);
  BATON_CHECK(estimate_job(*job).tasks() > 0);
}

/// What a coordinator does with a submitted document.
void look_at_document(std::string_view text) {
  const Result<ParsedJobDocument> document = parse_job_document(text);
  if (!document) return;
  BATON_CHECK(picture_differences(*document, *document).empty());
  BATON_CHECK(count_tasks(document->job) == estimate_job(document->job).tasks());
}

}  // namespace
}  // namespace baton

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  baton::look_at_job(text);
  baton::look_at_document(text);
  return 0;
}
