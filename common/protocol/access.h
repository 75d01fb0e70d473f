#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/protocol/keys.h"

namespace baton {

/// How a connection is kept from strangers. insecure: it need not be.
struct ClientAccess {
  std::optional<ClientKey> key = {};
  bool insecure = false;
  /// The key is that of own_key(), which may be made, or change, later.
  bool finds_key = false;
};
struct ServerAccess {
  std::optional<ServerKey> key;
  bool insecure = false;
  /// Where the key was read, to be looked at again; empty: it does not change.
  std::filesystem::path key_file = {};
  /// Of keys that the coordinator has made for itself; empty: none.
  std::filesystem::path own_keys = {};
};

/// Whether an endpoint is reached from this machine alone, and whether all its users reach it: a
/// loopback address, or an abstract socket.
bool is_of_this_machine(const std::string& endpoint);
bool is_open_to_users(const std::string& endpoint);

/// Of a coordinator of this user that has made keys for itself (OwnKeysNote) at this endpoint;
/// nullopt: there is none. Errors: those of the file.
Result<std::optional<ClientKey>> own_key(const std::string& endpoint);
/// key_file: empty where there is none; then own_key() stands in. Errors: those of the file.
Result<ClientAccess> client_access(const std::string& key_file, bool insecure,
                                   const std::string& endpoint);
/// key_file: empty where there is none; then a coordinator whose endpoint is open to all users of
/// this machine makes keys in its work folder, or takes those that it made before. Their bearers
/// have no names, so that everything is as without keys. Errors: those of the files.
Result<ServerAccess> server_access(const std::string& key_file, bool insecure,
                                   const std::string& endpoint,
                                   const std::filesystem::path& work_dir);

/// Says to the other programs of this user, while it lives, where the keys are that the coordinator
/// at this endpoint has made for itself: in a file below $XDG_STATE_HOME, or ~/.local/state. With
/// other keys or none it says that there are no such. Where it cannot, that is logged.
class OwnKeysNote {
 public:
  OwnKeysNote(const std::string& endpoint, const ServerAccess& access);
  OwnKeysNote(const OwnKeysNote&) = delete;
  OwnKeysNote& operator=(const OwnKeysNote&) = delete;
  ~OwnKeysNote();

 private:
  std::filesystem::path file_, keys_;
};

/// Refuses an endpoint that other machines reach and nothing protects. Where that is wanted, a
/// warning is logged.
Status check_exposure(const std::string& endpoint, bool has_key, bool insecure);

}  // namespace baton
