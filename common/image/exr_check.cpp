#include "common/image/exr_check.h"

#include <OpenEXR/ImfCheckFile.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <exception>

#include "common/image/exr_header.h"
#include "common/image/exr_planes.h"

namespace baton {

std::optional<std::string> text_of_whole_exr(const std::filesystem::path& path,
                                             const std::string& attribute) {
  if (!check_exr_attributes(path)) return std::nullopt;
  try {
    // True: something is wrong with it.
    if (Imf::checkOpenEXRFile(path.c_str())) return std::nullopt;
    const Imf::MultiPartInputFile file(path.c_str(), kOpenExrThreads);
    const auto* const text =
        file.header(0).findTypedAttribute<Imf::StringAttribute>(attribute.c_str());
    return text == nullptr ? std::string() : text->value();
  } catch (const std::exception&) {  // of OpenEXR
    return std::nullopt;
  }
}

}  // namespace baton
