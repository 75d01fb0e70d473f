#include "common/store/blob_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {

namespace fs = std::filesystem;

namespace {

/// All workers of a farm are of one account.
constexpr mode_t kOwnersOnly = 0600;
constexpr std::string_view kJobs = "jobs";  ///< the folder of documents

/// The files below a folder, of this extension, that nobody has written to for kLeftoverAge. What
/// cannot be read is left out.
std::vector<fs::path> old_files(const fs::path& folder, const char* extension) {
  std::vector<fs::path> files;
  const auto oldest = fs::file_time_type::clock::now() - BlobStore::kLeftoverAge;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() != extension) continue;
    std::error_code gone;
    const auto written = entry->last_write_time(gone);
    if (!gone && written < oldest) files.push_back(entry->path());
  }
  return files;
}

/// Whether the file is there with this content; then it is as young as one written now.
bool is_put_again(const fs::path& file, ByteView bytes) {
  if (!expect_content(file, bytes)) return false;
  std::error_code error;
  fs::last_write_time(file, fs::file_time_type::clock::now(), error);
  return !error;
}

}  // namespace

Result<BlobStore> BlobStore::open(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot create: {}", directory.string(), error.message())};
  BATON_TRY(sync_folder(directory));
  return BlobStore(directory);
}

Result<Digest> BlobStore::put(ByteView bytes) {
  const Digest digest = digest_of(bytes);
  if (bytes.size() > limits::kMaxBlobBytes) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: {} bytes, at most {} are stored", path(digest).string(),
                             bytes.size(), limits::kMaxBlobBytes)};
  }
  if (is_put_again(path(digest), bytes)) return digest;
  // No rename replaces a folder.
  std::error_code error;
  if (fs::is_directory(path(digest), error)) BATON_TRY(remove(digest));
  BATON_TRY(expect_space(directory_, bytes.size(), limits::kStoreReserveBytes));
  BATON_TRY(write_file_unsynced(path(digest), bytes, kOwnersOnly));
  return digest;
}

Status BlobStore::sync() const { return sync_file_system(directory_); }

Result<Bytes> BlobStore::get(const Digest& digest) const {
  const fs::path file = path(digest);
  BATON_ASSIGN(Bytes bytes, read_file(file, limits::kMaxBlobBytes));
  if (const Digest found = digest_of(bytes); found != digest) {
    return Error{ErrorKind::corrupt, fmt::format("{}: digest {}, expected {}", file.string(),
                                                 found.hex(), digest.hex())};
  }
  return bytes;
}

bool BlobStore::contains(const Digest& digest) const {
  std::error_code error;
  return fs::is_regular_file(path(digest), error);
}

Status BlobStore::remove(const Digest& digest) {
  std::error_code error;
  fs::remove_all(path(digest), error);
  if (error)
    return Error{ErrorKind::io,
                 fmt::format("{}: cannot remove: {}", path(digest).string(), error.message())};
  return {};
}

std::size_t BlobStore::clean_up() const {
  std::size_t count = 0;
  std::error_code gone;
  for (const fs::path& file : old_files(directory_, ".tmp")) count += fs::remove(file, gone);
  return count;
}

std::vector<BlobStore::Leftover> BlobStore::old_blobs() const {
  std::vector<Leftover> blobs;
  for (const fs::path& file : old_files(directory_, ".blob")) {
    const auto digest =
        Digest::from_hex(file.parent_path().filename().string() + file.stem().string());
    std::error_code gone;
    const std::uintmax_t size = fs::file_size(file, gone);
    if (digest && !gone && file == path(*digest)) blobs.push_back({*digest, size});
  }
  return blobs;
}

std::vector<Digest> BlobStore::old_job_files() const {
  std::vector<Digest> jobs;
  for (const fs::path& file : old_files(directory_ / kJobs, ".json")) {
    if (const auto job = Digest::from_hex(file.stem().string())) jobs.push_back(*job);
  }
  return jobs;
}

fs::path BlobStore::job_file(const Digest& job) const {
  return directory_ / kJobs / (job.hex() + ".json");
}

bool BlobStore::is_folder(const fs::path& entry) {
  const std::string name = entry.filename().string();
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return name == kJobs || (name.size() == 2 && std::ranges::all_of(name, is_digit));
}

fs::path BlobStore::path(const Digest& digest) const {
  const std::string hex = digest.hex();
  return directory_ / hex.substr(0, 2) / (hex.substr(2) + ".blob");
}

}  // namespace baton
