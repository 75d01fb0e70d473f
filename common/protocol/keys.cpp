#include "common/protocol/keys.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <sstream>
#include <vector>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxKeyFileBytes = 1 << 20;
constexpr std::size_t kKeyLength = 40;
constexpr std::array<Role, 4> kRoles{Role::worker, Role::viewer, Role::user, Role::admin};
constexpr const char* kHeader =
    "# A key of Baton (docs/farm.md). Whoever can read it is taken for its owner.\n";

std::optional<Role> role_of(std::string_view name) {
  const auto found = std::find_if(kRoles.begin(), kRoles.end(),
                                  [&](Role role) { return role_name(role) == name; });
  return found == kRoles.end() ? std::nullopt : std::optional(*found);
}

bool is_key(const std::string& text) {
  std::array<std::uint8_t, 32> bytes;
  return text.size() == kKeyLength && ::zmq_z85_decode(bytes.data(), text.c_str()) != nullptr;
}

bool is_name(const std::string& name) {
  constexpr std::string_view kLetters =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
  return !name.empty() && name.size() <= limits::kMaxNameLength && name.front() != '.' &&
         name.find_first_not_of(kLetters) == std::string::npos;
}

/// A line of a key file that says something.
struct KeyLine {
  int number = 0;
  std::vector<std::string> words;
};

Result<std::vector<KeyLine>> read_lines(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && (status.st_mode & 077) != 0) {
    return Error{ErrorKind::usage,
                 fmt::format("{0}: others may read this key: chmod 600 {0}", path.string())};
  }
  BATON_ASSIGN(const std::string text, read_text_file(path, kMaxKeyFileBytes));
  std::vector<KeyLine> lines;
  std::istringstream stream(text);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    KeyLine read{number, {}};
    for (std::string word; words >> word;) read.words.push_back(word);
    if (!read.words.empty()) lines.push_back(std::move(read));
  }
  return lines;
}

Error line_error(const fs::path& path, const KeyLine& line, std::string_view expected) {
  return {ErrorKind::bad_input, fmt::format("{}: line {}: '{}': expected {}", path.string(),
                                            line.number, line.words[0], expected)};
}

Result<KeyPair> draw_key() {
  std::array<char, kKeyLength + 1> public_key{}, secret_key{};
  if (::zmq_curve_keypair(public_key.data(), secret_key.data()) != 0)
    return Error{ErrorKind::internal, fmt::format("no key can be made: {}", ::zmq_strerror(errno))};
  return KeyPair{public_key.data(), secret_key.data()};
}

/// Writes a file that only its owner may read. flags: O_EXCL or O_APPEND.
Status write_secret(const fs::path& path, const std::string& text, int flags) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | flags, 0600);
  if (file < 0) {
    return Error{errno == EEXIST ? ErrorKind::usage : ErrorKind::io,
                 fmt::format("{}: {}", path.string(),
                             errno == EEXIST ? "is there already; a key is not replaced"
                                             : std::strerror(errno))};
  }
  const bool written =
      ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size()) &&
      ::fsync(file) == 0;
  if (::close(file) == 0 && written) return {};
  return Error{ErrorKind::io, fmt::format("{}: cannot write", path.string())};
}

/// Writes the key of a client; returns the line by which the coordinator knows it.
Result<std::string> write_client_key(const fs::path& folder, const Speaker& speaker,
                                     const std::string& server_public_key) {
  BATON_ASSIGN(const KeyPair pair, draw_key());
  const std::string text = fmt::format("{}role {}\nname {}\npublic {}\nsecret {}\nserver {}\n",
                                       kHeader, role_name(speaker.role), speaker.name,
                                       pair.public_key, pair.secret_key, server_public_key);
  BATON_TRY(write_secret(folder / (speaker.name + ".key"), text, O_EXCL));
  return fmt::format("knows {} {} {}\n", role_name(speaker.role), speaker.name, pair.public_key);
}

}  // namespace

std::string_view role_name(Role role) {
  constexpr std::array<std::string_view, 4> kNames{"worker", "viewer", "user", "admin"};
  return kNames.at(static_cast<std::size_t>(role));
}

// ---- files --------------------------------------------------------------------------------------

Result<ClientKey> read_client_key(const fs::path& path) {
  constexpr std::array kNeeded{"role", "name", "public", "secret", "server"};
  BATON_ASSIGN(const std::vector<KeyLine> lines, read_lines(path));
  std::map<std::string, std::string> said;
  for (const KeyLine& line : lines) {
    const std::string& what = line.words[0];
    const std::string value = line.words.size() == 2 ? line.words[1] : "";
    if (what == "knows")
      return Error{ErrorKind::usage,
                   fmt::format("{}: is the key of a coordinator, expected that of a worker, a "
                               "viewer, a user or an admin",
                               path.string())};
    const bool good = what == "role"   ? role_of(value).has_value()
                      : what == "name" ? is_name(value)
                                       : is_key(value);
    if (!good || std::ranges::find(kNeeded, what) == kNeeded.end())
      return line_error(path, line,
                        "role, name, public, secret or server, and a value of its kind");
    said[what] = value;
  }
  if (said.size() == kNeeded.size())
    return ClientKey{
        {*role_of(said["role"]), said["name"]}, {said["public"], said["secret"]}, said["server"]};
  return Error{ErrorKind::bad_input,
               fmt::format("{}: no whole key: role, name, public, secret and server are needed",
                           path.string())};
}

Result<ServerKey> read_server_key(const fs::path& path) {
  BATON_ASSIGN(const std::vector<KeyLine> lines, read_lines(path));
  ServerKey key;
  for (const KeyLine& line : lines) {
    const std::string& what = line.words[0];
    const std::size_t count = line.words.size();
    if (what == "role")
      return Error{ErrorKind::usage,
                   fmt::format("{}: is the key of a worker, a viewer, a user or an admin, expected "
                               "that of a coordinator",
                               path.string())};
    if (what == "public" && count == 2 && is_key(line.words[1])) {
      key.own.public_key = line.words[1];
    } else if (what == "secret" && count == 2 && is_key(line.words[1])) {
      key.own.secret_key = line.words[1];
    } else if (what == "knows" && count == 4 && role_of(line.words[1]) && is_name(line.words[2]) &&
               is_key(line.words[3])) {
      key.known[line.words[3]] = {*role_of(line.words[1]), line.words[2]};
    } else {
      return line_error(path, line, "public KEY, secret KEY or knows ROLE NAME KEY");
    }
  }
  if (!key.own.public_key.empty() && !key.own.secret_key.empty()) return key;
  return Error{ErrorKind::bad_input,
               fmt::format("{}: no whole key: public and secret are needed", path.string())};
}

Status create_keys(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  const std::array<Speaker, 4> speakers{Speaker{Role::worker, "worker"},
                                        Speaker{Role::viewer, "viewer"},
                                        Speaker{Role::user, "user"}, Speaker{Role::admin, "admin"}};
  for (const char* name : {"server", "worker", "viewer", "user", "admin"}) {
    if (const fs::path path = folder / (std::string(name) + ".key"); fs::exists(path, error))
      return Error{ErrorKind::usage,
                   fmt::format("{}: is there already; a key is not replaced", path.string())};
  }
  BATON_ASSIGN(const KeyPair pair, draw_key());
  std::string server =
      fmt::format("{}public {}\nsecret {}\n", kHeader, pair.public_key, pair.secret_key);
  for (const Speaker& speaker : speakers) {
    BATON_ASSIGN(const std::string line, write_client_key(folder, speaker, pair.public_key));
    server += line;
  }
  return write_secret(folder / "server.key", server, O_EXCL);
}

Status add_key(const fs::path& folder, const Speaker& speaker) {
  if (!is_name(speaker.name)) {
    return Error{ErrorKind::usage,
                 fmt::format("'{}': expected a name of letters, digits, '-', '_' and '.'",
                             speaker.name.substr(0, limits::kMaxNameLength))};
  }
  BATON_ASSIGN(const ServerKey server, read_server_key(folder / "server.key"));
  BATON_ASSIGN(const std::string line, write_client_key(folder, speaker, server.own.public_key));
  return write_secret(folder / "server.key", line, O_APPEND);
}

}  // namespace baton
