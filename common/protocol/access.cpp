#include "common/protocol/access.h"

#include <fmt/format.h>
#include <pwd.h>
#include <spdlog/spdlog.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "common/base/files.h"
#include "common/base/limits.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kTcp = "tcp://";
constexpr std::string_view kAbstract = "ipc://@";

/// Of "tcp://host:port".
std::string host_of(const std::string& endpoint) {
  if (!endpoint.starts_with(kTcp)) return {};
  const std::size_t colon = std::max(endpoint.rfind(':'), kTcp.size());
  return endpoint.substr(kTcp.size(), colon - kTcp.size());
}

bool is_loopback(const std::string& host) {
  const bool is_127 =
      host.starts_with("127.") && host.find_first_not_of("0123456789.") == std::string::npos;
  return is_127 || host == "localhost" || host == "[::1]" || host == "lo";
}

/// Where programs of this user keep what they remember; empty: nowhere.
fs::path state_folder() {
  const char* const state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && fs::path(state).is_absolute()) return fs::path(state) / "baton";
  const char* home = std::getenv("HOME");
  if (home == nullptr || !fs::path(home).is_absolute()) {
    const struct passwd* const user = ::getpwuid(::geteuid());
    home = user != nullptr ? user->pw_dir : nullptr;
  }
  return home == nullptr || !fs::path(home).is_absolute() ? fs::path()
                                                          : fs::path(home) / ".local/state/baton";
}

/// The file about an endpoint of this machine; home folders may be those of several machines.
fs::path note_of(const std::string& endpoint) {
  const fs::path folder = state_folder();
  if (folder.empty()) return {};
  std::array<char, 256> machine{};
  ::gethostname(machine.data(), machine.size() - 1);
  std::string place = endpoint.substr(endpoint.find("://") + 3);
  const std::string host = host_of(endpoint);
  if (host == "localhost" || host == "lo") place = "127.0.0.1" + place.substr(host.size());
  std::string name = fmt::format("{}-{}", machine.data(), place);
  std::ranges::replace_if(
      name, [](char c) { return c == '/' || c == ':' || c == '@' || c == '\0'; }, '-');
  constexpr std::size_t kMost = 200;
  return folder / "coordinators" / name.substr(0, kMost);
}

bool is_mine(const fs::path& file) {
  struct stat status {};
  return ::lstat(file.c_str(), &status) == 0 && S_ISREG(status.st_mode) &&
         status.st_uid == ::geteuid();
}

/// What a note says; empty: there is none of this user.
fs::path noted_keys(const fs::path& note) {
  if (note.empty() || !is_mine(note)) return {};
  const Result<std::string> text = read_text_file(note, limits::kMaxTextLength);
  return text ? fs::path(text->substr(0, text->find('\n'))) : fs::path();
}

/// Made at once or not at all: whoever was killed meanwhile, or comes at the same time, leaves no
/// half of them.
Status make_own_keys(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder.parent_path(), error);
  std::string made = folder.string() + ".XXXXXX";
  if (::mkdtemp(made.data()) == nullptr)
    return Error{ErrorKind::io, fmt::format("{}: cannot make keys", folder.parent_path().string())};
  const Status created = create_keys(made);
  if (created) fs::rename(made, folder, error);
  if (created && !error) return {};
  std::error_code gone;
  fs::remove_all(made, gone);
  if (!created) return created;
  return fs::exists(folder / "server.key", gone)
             ? Status()
             : Error{ErrorKind::io, fmt::format("{}: {}", folder.string(), error.message())};
}

/// Removes the notes of coordinators that were killed and whose work folders are gone.
void forget_lost_keys(const fs::path& notes) {
  std::error_code error;
  for (fs::directory_iterator note(notes, error), end; !error && note != end;
       note.increment(error)) {
    std::error_code gone;
    const fs::path keys = noted_keys(note->path());
    if (!keys.empty() && fs::exists(keys.parent_path().parent_path(), gone) &&
        !fs::exists(keys, gone) && !gone)
      fs::remove(note->path(), gone);
  }
}

}  // namespace

bool is_of_this_machine(const std::string& endpoint) {
  return endpoint.starts_with("ipc://") || endpoint.starts_with("inproc://") ||
         is_loopback(host_of(endpoint));
}

bool is_open_to_users(const std::string& endpoint) {
  return endpoint.starts_with(kAbstract) || is_loopback(host_of(endpoint));
}

Result<std::optional<ClientKey>> own_key(const std::string& endpoint) {
  if (!is_open_to_users(endpoint)) return std::optional<ClientKey>();
  const fs::path keys = noted_keys(note_of(endpoint));
  const fs::path own = keys / "admin.key";
  if (keys.empty() || !is_mine(own)) return std::optional<ClientKey>();
  BATON_ASSIGN(ClientKey key, read_client_key(own));
  return std::optional(std::move(key));
}

Result<ClientAccess> client_access(const std::string& key_file, bool insecure,
                                   const std::string& endpoint) {
  if (!key_file.empty()) {
    BATON_ASSIGN(ClientKey key, read_client_key(key_file));
    return ClientAccess{std::move(key), insecure};
  }
  ClientAccess access{.insecure = insecure, .finds_key = !insecure && is_open_to_users(endpoint)};
  if (access.finds_key) {
    BATON_ASSIGN(access.key, own_key(endpoint));
  }
  return access;
}

Result<ServerAccess> server_access(const std::string& key_file, bool insecure,
                                   const std::string& endpoint, const fs::path& work_dir) {
  if (!key_file.empty()) {
    BATON_ASSIGN(ServerKey key, read_server_key(key_file));
    return ServerAccess{std::move(key), insecure, key_file};
  }
  ServerAccess access{std::nullopt, insecure};
  if (insecure || !is_open_to_users(endpoint)) return access;
  std::error_code error;
  access.own_keys = fs::absolute(work_dir, error) / "own-keys";
  const fs::path server_key = access.own_keys / "server.key";
  if (!fs::exists(server_key, error)) BATON_TRY(make_own_keys(access.own_keys));
  if (!is_mine(server_key)) {
    return Error{ErrorKind::usage,
                 server_key.string() + ": is not this user's own: remove it, or give --key"};
  }
  Result<ServerKey> own = read_server_key(server_key);
  if (!own) {
    return Error{own.error().kind,
                 own.error().message +
                     "; these keys keep other users of this machine out: --key gives keys of "
                     "another folder, --insecure goes without"};
  }
  // The one that `baton` and workers find by themselves is nobody's name.
  for (auto& [key, speaker] : own->known) {
    if (speaker.role == Role::admin) speaker = {};
  }
  access.key = std::move(*own);
  return access;
}

OwnKeysNote::OwnKeysNote(const std::string& endpoint, const ServerAccess& access)
    : file_(note_of(endpoint)), keys_(access.own_keys) {
  if (!is_open_to_users(endpoint)) file_.clear();
  if (keys_.empty()) {
    std::error_code error;
    if (!file_.empty()) fs::remove(file_, error);
    file_.clear();
    return;
  }
  Status written = Error{ErrorKind::io, "this user has no home folder"};
  if (!file_.empty()) {
    std::error_code error;
    fs::create_directories(file_.parent_path(), error);
    fs::permissions(file_.parent_path(), fs::perms::owner_all, error);
    written = write_file_atomic(file_, as_bytes_view(keys_.string() + "\n"));
    forget_lost_keys(file_.parent_path());
  }
  if (!written)
    spdlog::warn("other programs do not find the keys by themselves, give them --key {}: {}",
                 (keys_ / "admin.key").string(), written.error().message);
}

OwnKeysNote::~OwnKeysNote() {
  std::error_code error;
  if (!file_.empty() && noted_keys(file_) == keys_) fs::remove(file_, error);
}

Status check_exposure(const std::string& endpoint, bool has_key, bool insecure) {
  if (has_key || is_of_this_machine(endpoint)) return {};
  if (insecure) {
    spdlog::warn(
        "INSECURE: {} has no key: whoever reaches it can stop the farm, read names and write "
        "files",
        endpoint);
    return {};
  }
  return Error{ErrorKind::usage,
               fmt::format("{}: other machines reach it, so it needs a key: --key or BATON_KEY "
                           "(`baton key create FOLDER` makes keys; --insecure goes without)",
                           endpoint)};
}

}  // namespace baton
