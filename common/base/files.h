#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/result.h"

namespace baton {

/// ErrorKind::bad_input when nothing has this name. For names that a person typed: no disk has
/// failed.
Status expect_file(const std::filesystem::path& path);

/// ".exr" of "a/b.EXR"; empty: it has none.
std::string lower_extension(const std::filesystem::path& path);

/// The whole file. Errors name the file: missing, not readable, larger than `max_size_bytes`.
Result<Bytes> read_file(const std::filesystem::path& path, std::uint64_t max_size_bytes);
Result<std::string> read_text_file(const std::filesystem::path& path, std::uint64_t max_size_bytes);

/// The folders that files may be in; empty: all.
using Roots = std::vector<std::filesystem::path>;

/// Publishes `bytes` at `path` whole or not at all: a new file of an unforeseeable name in the same
/// folder, fsync, rename, fsync of the folder. Creates missing folders; follows no link at either
/// name. Two writers of the same path are harmless: the last rename wins. Error (bad_input): the
/// folder, as it is held open, is in none of `roots`; links on the way to it may have changed since
/// the path was looked at.
Status write_file_atomic(const std::filesystem::path& path, ByteView bytes,
                         const Roots& roots = {});

/// Publishes a file that nobody reads again before it counts: the temporary file, once it is on
/// disk, is read back and compared with `bytes` byte by byte and handed to `may_replace`, which
/// says whether what has the name now may go; only then it gets its name. Returns whether it did:
/// false where nothing may go and something has the name, seen from this machine or not (a disk
/// that cannot tell, without hard links and RENAME_NOREPLACE, replaces it). Errors: that of
/// `may_replace`; that of write_file_atomic; ErrorKind::corrupt names the first byte that differs.
/// Nothing is left behind on failure.
Result<bool> write_file_verified(
    const std::filesystem::path& path, ByteView bytes,
    const std::function<Result<bool>(const std::filesystem::path& temporary)>& may_replace,
    const Roots& roots = {});

/// ErrorKind::corrupt unless the file has exactly `bytes`.
Status expect_content(const std::filesystem::path& path, ByteView bytes);

/// Publishes as write_file_atomic does, without waiting for the disk: other processes see the file
/// whole or not at all, but only sync_file_system() makes it survive a power cut. rights: of the
/// file, before the process's mask.
Status write_file_unsynced(const std::filesystem::path& path, ByteView bytes, mode_t rights = 0644);

/// Error no_space: writing so much to the file system of `folder` would leave less than a reserve,
/// at most a twentieth of it.
Status expect_space(const std::filesystem::path& folder, std::uint64_t size_bytes,
                    std::uint64_t reserve_bytes);

/// Waits until everything written so far to the file system of `path` is on disk (Linux syncfs).
Status sync_file_system(const std::filesystem::path& path);

/// fsync a folder: names made or renamed in it survive a power cut.
Status sync_folder(const std::filesystem::path& folder);

}  // namespace baton
