#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/digest.h"
#include "common/base/result.h"

namespace baton {

/// Blobs in a folder, named by their digest: `<directory>/ab/cdef....blob`. Any number of processes
/// may share the folder, on one machine or over a network file system with atomic rename: a blob
/// appears whole or not at all, and two writers of the same blob write the same bytes.
class BlobStore {
 public:
  /// Creates the folder where it is missing; its subfolders come with their first blobs. Errors: a
  /// path that cannot be created.
  static Result<BlobStore> open(const std::filesystem::path& directory);

  /// Publishes the bytes: from now on every process sees the blob, but it survives a power cut only
  /// after sync(). A blob that is there already, whole, is not written again but counts as put now:
  /// one that survives a power cut is never replaced by one that does not. One that is damaged or
  /// cannot be read is mended, and what has its name makes way, whatever it is.
  /// Errors: past limits::kMaxBlobBytes, the disk; no_space where it is so full that frames and the
  /// journal may soon have none.
  Result<Digest> put(ByteView bytes);

  /// Makes all blobs put so far durable, with one wait for the disk.
  Status sync() const;

  /// The bytes with this digest. ErrorKind::corrupt names the file, the digest found and the one
  /// expected; a missing blob is ErrorKind::io.
  Result<Bytes> get(const Digest& digest) const;

  /// Whether the blob was published; does not read it.
  bool contains(const Digest& digest) const;

  /// Forgets the blob, and whatever has its name. One that is already gone is a success.
  Status remove(const Digest& digest);

  /// Removes what processes that died while they wrote have left: temporary files that nobody has
  /// touched for kLeftoverAge, longer than any write takes. Returns how many.
  std::size_t clean_up() const;
  static constexpr std::chrono::hours kLeftoverAge{1};

  /// The blobs that nobody has put for kLeftoverAge: whoever needs none of them made them earlier.
  struct Leftover {
    Digest digest;
    std::uint64_t size_bytes = 0;
  };
  std::vector<Leftover> old_blobs() const;
  /// The jobs whose job_file() is as old.
  std::vector<Digest> old_job_files() const;

  /// Where workers save a job's document until it ends, so that a failed tile can be replayed
  /// alone.
  std::filesystem::path job_file(const Digest& job) const;
  /// Whether an entry of a store's folder has the name of one of its folders.
  static bool is_folder(const std::filesystem::path& entry);

  /// Where the blob is or would be.
  std::filesystem::path path(const Digest& digest) const;

 private:
  explicit BlobStore(std::filesystem::path directory) : directory_(std::move(directory)) {}

  std::filesystem::path directory_;
};

}  // namespace baton
