#include "common/base/build.h"

#include <fmt/format.h>
#include <zstd.h>

#include "common/base/sources_digest.h"
#include "common/base/version.h"

namespace baton {

std::string build_identity() {
  return fmt::format("baton {} (sources {}, zstd {})", kVersion, kSourcesDigest,
                     ZSTD_versionString());
}

}  // namespace baton
