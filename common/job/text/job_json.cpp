#include "common/job/text/job_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/job/motion.h"
#include "common/job/text/job_fields.h"
#include "common/job/text/job_json_reader.h"
#include "common/job/text/job_json_text.h"
#include "common/job/text/job_json_writer.h"
#include "common/job/text/picture.h"
#include "common/job/udim.h"

namespace baton {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr int kMaxAssets = limits::kMaxMeshes + limits::kMaxFrames;

/// Bytes that are no UTF-8 (a folder's name can have them) are replaced: the path will then be
/// reported as missing.
std::string dump(const ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, ordered_json::error_handler_t::replace);
}

void fields(JobArchive& a, AssetDigest& asset) {
  a.path(required("path"), asset.path);
  std::string hex = asset.digest.hex();
  if (!a.text(required("digest"), hex)) return;
  const std::optional<Digest> digest = Digest::from_hex(hex);
  if (!digest) a.fault("digest", "32 hexadecimal digits", fmt::format("\"{}\"", hex));
  asset.digest = digest.value_or(Digest{});
}

void fields(JobArchive& a, ParsedJobDocument& document) {
  a.object(required("job"), [&] { fields(a, document.job); });
  a.list(required("assets"), document.assets, kMaxAssets,
         [&](AssetDigest& asset) { fields(a, asset); });
  if (!is_settled(document.job))
    a.fault("job", "meshes in place of scene.gltf, motion as keys, and motion.maxPx >= 1",
            "a job that is not settled");
}

template <class T>
std::string write(T value, int indent) {
  JobJsonWriter writer;
  fields(writer, value);
  return dump(writer.json(), indent);
}

/// Reads a job, which is `job` where the text says nothing; `defaulted`, where wanted, gets the
/// paths of what it does not say.
Result<JobSpec> read(std::string_view text, const std::string& name,
                     const std::filesystem::path& base_directory, JobSpec job,
                     const std::vector<JobOverride>& overrides = {},
                     std::set<std::string>* defaulted = nullptr) {
  BATON_ASSIGN(json root, parse_json_text(text, name));
  JobJsonReader reader(name, base_directory, overrides);
  BATON_TRY(reader.read(std::move(root), [&] { fields(reader, job); }));
  if (defaulted != nullptr) *defaulted = reader.defaulted();
  return job;
}

/// Digests of all files; one error names each that cannot be read.
Result<std::vector<AssetDigest>> digest_files(const std::vector<std::string>& paths) {
  std::vector<AssetDigest> assets;
  std::string faults;
  for (const std::string& path : paths) {
    const Result<Bytes> bytes = read_file(path, limits::kMaxAssetFileBytes);
    if (bytes) assets.push_back({path, digest_of(*bytes)});
    if (!bytes) faults += (faults.empty() ? "" : "\n") + bytes.error().message;
  }
  if (!faults.empty()) return Error{ErrorKind::bad_input, faults};
  return assets;
}

Result<std::string> read_job_text(const std::filesystem::path& path) {
  BATON_TRY(expect_file(path));
  return read_text_file(path, limits::kMaxJobFileBytes);
}

/// Appends the leaves of `value`, in order. given: whether the text says anything about it.
void collect_settings(const ordered_json& value, const std::string& path,
                      const std::set<std::string>& defaulted, bool given,
                      std::vector<JobSetting>& settings) {
  given = given && !defaulted.contains(path);
  const bool vector = value.is_array() && (value.empty() || !value.front().is_object());
  if (value.is_object() && !value.empty()) {
    for (const auto& [key, inner] : value.items()) {
      collect_settings(inner, json_path_key(path, key), defaulted, given, settings);
    }
  } else if (value.is_array() && !vector) {
    for (std::size_t i = 0; i < value.size(); ++i) {
      collect_settings(value[i], json_path_index(path, i), defaulted, given, settings);
    }
  } else {
    settings.push_back({path, dump(value, -1), given});
  }
}

/// So that whoever checks the list has checked all that the job has opened.
Status expect_all_assets(const ParsedJobDocument& document) {
  const std::vector<std::string> expected = asset_paths(document.job);
  if (std::ranges::equal(document.assets, expected, {}, &AssetDigest::path)) return {};
  const auto [asset, path] =
      std::ranges::mismatch(document.assets, expected, {}, &AssetDigest::path);
  return Error{
      ErrorKind::bad_input,
      fmt::format("job document: $.assets: expected the {} files that the job names, in their "
                  "order, {}",
                  expected.size(),
                  path == expected.end() ? fmt::format("got also {}", asset->path)
                                         : fmt::format("{} among them", *path))};
}

}  // namespace

Result<JobSpec> parse_job(std::string_view text, const std::string& name,
                          const std::filesystem::path& base_directory) {
  return read(text, name, base_directory, {});
}

JobSpec preset_job() {
  JobSpec job;
  job.light.bounces = limits::kPresetBounces;
  return job;
}

Result<JobSpec> load_job(const std::filesystem::path& path,
                         const std::vector<JobOverride>& overrides) {
  BATON_ASSIGN(const std::string text, read_job_text(path));
  return read(text, path.string(), path.parent_path(), preset_job(), overrides);
}

std::string to_json(const JobSpec& job) { return write(job, 2); }

Result<std::vector<JobSetting>> explain_job(const std::filesystem::path& path,
                                            const std::vector<JobOverride>& overrides) {
  BATON_ASSIGN(const std::string text, read_job_text(path));
  std::set<std::string> defaulted;
  BATON_ASSIGN(const JobSpec job,
               read(text, path.string(), path.parent_path(), preset_job(), overrides, &defaulted));
  std::vector<JobSetting> settings;
  collect_settings(ordered_json::parse(to_json(job)), "$", defaulted, true, settings);
  return settings;
}

std::vector<std::string> asset_paths(const JobSpec& job) {
  std::set<std::string> paths;
  for (const auto& item : job.scene.meshes) paths.insert(item.second.path);
  for (const auto& item : job.scene.materials) {
    if (item.second.kind == MaterialKind::measured) paths.insert(item.second.file);
    for (const TextureSpec* texture : textures_of(item.second)) {
      if (!has_tiles(texture->file)) paths.insert(texture->file);  // tiles are in scene.files
    }
  }
  for (const FileSpec& file : job.scene.files) paths.insert(file.path);
  for (const EnvironmentKey& key : job.environment.keys) paths.insert(key.map);
  if (const std::string& map = job.environment.camera_map.file; !map.empty()) paths.insert(map);
  if (has_plate(job.output)) {
    for (const FrameNumber frame : job.frames) paths.insert(file_at(*job.output.plate, frame));
  }
  return {paths.begin(), paths.end()};
}

Result<std::string> make_job_document(const JobSpec& job) {
  if (job.sampling.method == Method::automatic) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("job '{}': $.sampling.method: \"auto\" is settled by `baton render` and "
                    "`baton job submit`, expected one that is",
                    job.name)};
  }
  BATON_TRY(check_settled(job));
  ParsedJobDocument document{.job = job, .assets = {}, .digest = {}, .picture = {}};
  BATON_ASSIGN(document.assets, digest_files(asset_paths(job)));
  return write(std::move(document), -1);
}

std::string with_sweeps(ParsedJobDocument document, int sweeps) {
  document.job.quality.sweeps = sweeps;
  document.job.quality.refinable = true;
  return write(std::move(document), -1);
}

Result<ParsedJobDocument> parse_job_document(std::string_view text) {
  BATON_ASSIGN(json root, parse_json_text(text, "job document"));
  ParsedJobDocument document;
  JobJsonReader reader("job document", "/");
  reader.forbid_files();
  BATON_TRY(reader.read(std::move(root), [&] { fields(reader, document); }));
  if (document.job.sampling.method == Method::automatic) {
    return Error{
        ErrorKind::bad_input,
        "job document: $.job.sampling.method: expected a method that is settled, got \"auto\""};
  }
  BATON_TRY(expect_all_assets(document));
  document.digest = digest_of(text);
  document.picture = picture_digest(document.job, document.assets);
  return document;
}

Status expect_written(const ParsedJobDocument& document, std::string_view text) {
  if (write(document, -1) == text) return {};
  return Error{
      ErrorKind::bad_input,
      "job document: expected it as `baton` writes one, without more blanks or other forms "
      "of values"};
}

Status verify_assets(const std::vector<AssetDigest>& assets) {
  std::string faults;
  ErrorKind kind = ErrorKind::io;
  for (const AssetDigest& asset : assets) {
    const Result<std::vector<AssetDigest>> now = digest_files({asset.path});
    std::string fault;
    if (!now) {
      fault = now.error().message;
    } else if (now->front().digest != asset.digest) {
      kind = ErrorKind::bad_input;
      fault = fmt::format("{}: changed since the job was submitted: expected digest {}, got {}",
                          asset.path, asset.digest.hex(), now->front().digest.hex());
    }
    if (!fault.empty()) faults += (faults.empty() ? "" : "\n") + fault;
  }
  if (!faults.empty()) return Error{kind, faults};
  return {};
}

}  // namespace baton
