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
enum class Role : std::uint8_t { worker, viewer, user, admin };
/// "worker", "viewer", "user", "admin".
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

  bool operator==(const KeyPair&) const = default;
};

/// The key of anybody but a coordinator, and the public key of the coordinator it belongs to.
struct ClientKey {
  Speaker speaker;
  KeyPair own;
  std::string server_public_key;

  bool operator==(const ClientKey& other) const {
    return own == other.own && server_public_key == other.server_public_key;
  }
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

/// Writes server.key, worker.key, viewer.key, user.key and admin.key, which only their owner may
/// read. Error: one of them is there already.
Status create_keys(const std::filesystem::path& folder);
/// Writes NAME.key, and lets it in with server.key. Errors: as above; a name that is no file name.
Status add_key(const std::filesystem::path& folder, const Speaker& speaker);

}  // namespace baton
