#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace baton {

/// What the bearer of a key is to a coordinator. coordinator/service/permissions.h says what each
/// may do.
enum class Role : std::uint8_t { worker, user, admin };
/// "worker", "user", "admin".
std::string_view role_name(Role role);

/// Who speaks on a connection, as its key proves. Where there are no keys everybody is an admin
/// without a name.
struct Speaker {
  Role role = Role::admin;
  std::string name;
};

/// The two halves of a CURVE key (ZeroMQ RFC 26) as text (Z85), 40 characters each.
struct KeyPair {
  std::string public_key, secret_key;
};

/// The key of a worker, a user or an admin, and the public key of the coordinator it belongs to.
struct ClientKey {
  Speaker speaker;
  KeyPair own;
  std::string server_public_key;
};

/// The key of a coordinator, and whom it lets in, by their public keys.
struct ServerKey {
  KeyPair own;
  std::map<std::string, Speaker> known;
};

/// Errors name the file and the line: a file that others may read, another kind of key, a line that
/// is not understood.
Result<ClientKey> read_client_key(const std::filesystem::path& path);
Result<ServerKey> read_server_key(const std::filesystem::path& path);

/// Writes server.key, worker.key, user.key and admin.key, which only their owner may read. Error:
/// one of them is there already.
Status create_keys(const std::filesystem::path& folder);
/// Writes NAME.key, and lets it in with server.key. Errors: as above; a name that is no file name.
Status add_key(const std::filesystem::path& folder, const Speaker& speaker);

/// How a connection is kept from strangers. insecure: it need not be.
struct ClientAccess {
  std::optional<ClientKey> key;
  bool insecure = false;
};
struct ServerAccess {
  std::optional<ServerKey> key;
  bool insecure = false;
};
/// key_file: empty where there is none.
Result<ClientAccess> client_access(const std::string& key_file, bool insecure);
Result<ServerAccess> server_access(const std::string& key_file, bool insecure);

/// Refuses an endpoint that other machines reach and nothing protects. Where that is wanted, a
/// warning is logged.
Status check_exposure(const std::string& endpoint, bool has_key, bool insecure);

}  // namespace baton
