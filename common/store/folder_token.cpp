#include "common/store/folder_token.h"

#include <fmt/format.h>

#include <optional>
#include <random>
#include <utility>

#include "common/base/file_stamp.h"
#include "common/base/files.h"

namespace baton {
namespace {

constexpr std::uint64_t kMaxTokenBytes = 1 << 20;

}  // namespace

std::filesystem::path output_token_file(const std::filesystem::path& folder, const Digest& job,
                                        const std::string& token) {
  return folder / (".baton-" + digest_of(as_bytes_view(job.hex() + token)).short_hex());
}

Result<std::string> make_token(const std::filesystem::path& file, const std::string& known) {
  Result<std::string> there = read_text_file(file, kMaxTokenBytes);
  if (there && !there->empty()) return there;
  std::random_device random;
  std::string token = known.empty() ? fmt::format("{:08x}{:08x}", random(), random()) : known;
  BATON_TRY(write_token(file, token));
  return token;
}

Status write_token(const std::filesystem::path& file, const std::string& token,
                   const std::string& line, const Roots& roots) {
  const std::string text = line.empty() ? token : token + "\n" + line;
  return write_file_atomic(file, as_bytes_view(text), roots);
}

namespace {

/// nullopt: nothing has this name, or what has it is no file. Error, io: it cannot be read now.
Result<std::optional<std::string>> read_if_there(const std::filesystem::path& file) {
  Result<std::string> found = read_text_file(file, kMaxTokenBytes);
  if (found) return std::optional(std::move(found).value());
  const Result<std::optional<FileStamp>> there = stamp_of(file);
  const bool is_none = there ? !*there : there.error().kind == ErrorKind::bad_input;
  if (is_none) return std::optional<std::string>();
  return Error{ErrorKind::io, found.error().message};
}

}  // namespace

Result<bool> has_token(const std::filesystem::path& file, const std::string& token) {
  BATON_ASSIGN(const std::optional<std::string> found, read_if_there(file));
  return found && (*found == token || found->starts_with(token + "\n"));
}

Result<std::string> read_after_token(const std::filesystem::path& file, const std::string& token,
                                     Patience* patience) {
  for (;;) {
    const Result<std::optional<std::string>> read = read_if_there(file);
    const std::optional<std::string> found = read ? *read : std::optional<std::string>();
    if (found && *found == token) return std::string();
    if (found && found->starts_with(token + "\n")) return found->substr(token.size() + 1);
    // What another machine has written may be seen here later.
    const Error waits_for =
        read ? Error{ErrorKind::io, file.string() + ", as the coordinator has written it"}
             : read.error();
    if (patience != nullptr && patience->wait_after(waits_for)) continue;
    if (!read) return read.error();
    std::error_code error;
    return Error{
        ErrorKind::io,
        fmt::format("{}: not the folder that the coordinator sees ({}: {}); mount it here, or "
                    "say where it is with --map",
                    file.parent_path().string(), file.filename().string(),
                    found                                  ? "has another token"
                    : std::filesystem::exists(file, error) ? "is no file"
                                                           : "no such file")};
  }
}

Status expect_token(const std::filesystem::path& file, const std::string& token,
                    Patience* patience) {
  const Result<std::string> line = read_after_token(file, token, patience);
  return line ? Status() : line.error();
}

}  // namespace baton
