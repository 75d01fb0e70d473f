#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/result.h"
#include "common/job/job_spec.h"

namespace baton {

/// What a job file says that says nothing: JobSpec, with light between surfaces. (Documents say
/// everything but what came after them, and that is as it was then.)
JobSpec preset_job();

/// The job of a JSON text, which is JobSpec where it says nothing. name goes first in every error
/// line (usually the file); relative paths are taken relative to base_directory. One Error lists
/// every fault, one per line: `job.json: $.image.width: expected an integer in [1, 32768], got
/// "wide"`; an unknown key names the likely one. Schema: jobs/schema/job.schema.json.
Result<JobSpec> parse_job(std::string_view json, const std::string& name,
                          const std::filesystem::path& base_directory);

/// A value that is said in place of the job file's.
struct JobOverride {
  /// Path in the JSON of the job: `image.sites`, `$.scene.objects[0].fitHeight`.
  std::string path;
  std::string value;             ///< JSON; what is none counts as a text
  std::string option = "--set";  ///< named in faults
};

/// Reads and parses a job file, which is preset_job() where it says nothing, with `overrides` put
/// into its JSON, the last one last. Faults of what was put in name the option instead of the file.
Result<JobSpec> load_job(const std::filesystem::path& path,
                         const std::vector<JobOverride>& overrides = {});

/// Canonical JSON of a job: every default written out, absolute paths, keys in a fixed order.
/// parse_job(to_json(j)) == j.
std::string to_json(const JobSpec& job);

/// One value in force, for `baton check --explain`.
struct JobSetting {
  /// Path in the canonical JSON, e.g. `$.image.width`.
  std::string path;
  std::string value;  ///< as JSON
  /// Said by the job file; otherwise a default.
  bool given = false;
};

/// Every value of a job file in force, in the order of to_json. Errors: those of load_job.
Result<std::vector<JobSetting>> explain_job(const std::filesystem::path& path,
                                            const std::vector<JobOverride>& overrides = {});

/// A file that the job reads, with the digest of its contents when the job was submitted.
struct AssetDigest {
  std::string path;  ///< absolute
  Digest digest;
  bool operator==(const AssetDigest&) const = default;
};

/// All asset paths of the job (meshes, maps), sorted, no duplicates.
std::vector<std::string> asset_paths(const JobSpec& job);

/// What is submitted, journalled and sent to workers: to_json(job) plus asset digests, as one JSON
/// text. Reads every asset; errors name the missing or unreadable ones, all of them. The motion of
/// the job must be settled (is_settled in motion.h).
Result<std::string> make_job_document(const JobSpec& job);

struct ParsedJobDocument {
  JobSpec job;
  std::vector<AssetDigest> assets;
  Digest digest;   ///< digest_of(text): the identity of the job
  Digest picture;  ///< picture_digest of it (picture.h)
};
/// The text of a document with so many sweeps, which stay for more; its files keep the digests that
/// they have in it.
std::string with_sweeps(ParsedJobDocument document, int sweeps);

/// Reads no other file: what a document says stands in it.
Result<ParsedJobDocument> parse_job_document(std::string_view text);
/// Error (bad_input): the text of a document is not the one that `baton` writes for its job, which
/// is no longer than what it says.
Status expect_written(const ParsedJobDocument& document, std::string_view text);

/// Checks that every asset still has the digest it had at submission. The error names each file
/// that changed (bad_input) or cannot be read here (io, if that is all: another machine may).
Status verify_assets(const std::vector<AssetDigest>& assets);

}  // namespace baton
