#include "common/store/folder_token.h"

#include <fmt/format.h>

#include <random>

#include "common/base/files.h"

namespace baton {
namespace {

constexpr std::uint64_t kMaxTokenBytes = 1 << 20;

}  // namespace

std::filesystem::path output_token_file(const std::filesystem::path& folder, const Digest& job) {
  return folder / (".baton-" + job.short_hex());
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
                   const std::string& line) {
  const std::string text = line.empty() ? token : token + "\n" + line;
  return write_file_atomic(file, as_bytes_view(text));
}

Result<std::string> read_after_token(const std::filesystem::path& file, const std::string& token,
                                     Patience* patience) {
  Result<std::string> found = read_text_file(file, kMaxTokenBytes);
  // What cannot be read says nothing of the folder.
  while (!found) {
    const Status there = expect_file(file);
    if (!there && there.error().kind == ErrorKind::bad_input) break;
    const Error error{ErrorKind::io, found.error().message};
    if (patience == nullptr || !patience->wait_after(error)) return error;
    found = read_text_file(file, kMaxTokenBytes);
  }
  if (found && *found == token) return std::string();
  if (found && found->starts_with(token + "\n")) return found->substr(token.size() + 1);
  return Error{
      ErrorKind::io,
      fmt::format("{}: not the folder that the coordinator sees ({}: {}); mount it here, or "
                  "say where it is with --map",
                  file.parent_path().string(), file.filename().string(),
                  found ? "has another token" : "not there")};
}

Status expect_token(const std::filesystem::path& file, const std::string& token,
                    Patience* patience) {
  const Result<std::string> line = read_after_token(file, token, patience);
  return line ? Status() : line.error();
}

}  // namespace baton
