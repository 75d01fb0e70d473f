#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/bytes.h"
#include "common/base/result.h"

namespace baton::gltf {

/// The two parts of a .glb, or the text of a .gltf alone.
struct Container {
  std::string_view json;
  std::optional<ByteView> binary;  ///< the first buffer, where that has no uri
};

/// Looks at `bytes`, which must outlive the result. Errors begin with `name`.
Result<Container> open_container(ByteView bytes, const std::string& name);

/// What a uri of a buffer or an image names: bytes that it holds itself (data:, base 64), or a file
/// beside the one at `path`.
struct Resource {
  std::optional<Bytes> bytes;
  std::string file;  ///< absolute where `path` is
};
/// Error: what is wrong with the uri.
Result<Resource> resolve_uri(const std::string& uri, const std::string& path);

}  // namespace baton::gltf
