# Run at each build: writes OUTPUT, a header with a digest of the sources under ROOT that decide what bytes a job gives,
# when it has changed.
file(GLOB_RECURSE sources RELATIVE ${ROOT} ${ROOT}/common/*.cpp ${ROOT}/common/*.h ${ROOT}/worker/*.cpp ${ROOT}/worker/*.h)
list(SORT sources)
set(digests "")
foreach(source ${sources})
  file(SHA256 ${ROOT}/${source} digest)
  string(APPEND digests "${source} ${digest}\n")
endforeach()
string(SHA256 digest "${digests}")
string(SUBSTRING ${digest} 0 12 digest)
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[
#pragma once

namespace baton {
/// Of common and worker.
inline constexpr const char* kSourcesDigest = "@digest@";
}  // namespace baton
]])
