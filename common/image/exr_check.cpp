#include "common/image/exr_check.h"

#include <OpenEXR/ImfCheckFile.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <exception>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/image/exr_header.h"
#include "common/image/exr_planes.h"
#include "common/image/frame_seal.h"

namespace baton {

std::optional<std::string> writer_of_frame(const std::filesystem::path& path) {
  if (!check_exr_attributes(path)) return std::nullopt;
  try {
    // True: something is wrong with it.
    if (Imf::checkOpenEXRFile(path.c_str())) return std::nullopt;
    const Imf::MultiPartInputFile file(path.c_str(), kOpenExrThreads);
    const auto* const text =
        file.header(0).findTypedAttribute<Imf::StringAttribute>("baton:jobDigest");
    Result<Bytes> bytes = read_file(path, limits::kMaxBlobBytes);
    const bool is_own =
        text != nullptr && bytes && is_sealed(path.filename().string(), std::move(bytes).value());
    return is_own ? text->value() : std::string();
  } catch (const std::exception&) {  // of OpenEXR
    return std::nullopt;
  }
}

}  // namespace baton
