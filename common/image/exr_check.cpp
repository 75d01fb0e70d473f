#include "common/image/exr_check.h"

#include <OpenEXR/ImfCheckFile.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <stdexcept>

#include "common/image/exr_header.h"
#include "common/image/exr_planes.h"
#include "common/image/frame_seal.h"

namespace baton {
namespace {

/// Bytes that OpenEXR reads as a file.
class BytesStream : public Imf::IStream {
 public:
  BytesStream(const std::string& name, const Bytes& bytes)
      : Imf::IStream(name.c_str()), bytes_(bytes) {}

  bool read(char to[], int count) override {
    if (static_cast<std::uint64_t>(count) > bytes_.size() - at_)
      throw std::runtime_error("unexpected end of file");
    std::memcpy(to, bytes_.data() + at_, static_cast<std::size_t>(count));
    at_ += static_cast<std::uint64_t>(count);
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t at) override { at_ = std::min<std::uint64_t>(at, bytes_.size()); }

 private:
  const Bytes& bytes_;
  std::uint64_t at_ = 0;
};

}  // namespace

std::optional<std::string> writer_of_frame(const std::string& name, const Bytes& exr) {
  if (exceeds_reader(exr)) return std::string();
  if (!check_exr_attributes(name, exr)) return std::nullopt;
  try {
    // True: something is wrong with it.
    if (Imf::checkOpenEXRFile(reinterpret_cast<const char*>(exr.data()), exr.size()))
      return std::nullopt;
    BytesStream stream(name, exr);
    const Imf::MultiPartInputFile file(stream, kOpenExrThreads);
    const auto* const text =
        file.header(0).findTypedAttribute<Imf::StringAttribute>("baton:jobDigest");
    if (text == nullptr || !is_sealed(name, exr)) return std::string();
    const auto* const renderer =
        file.header(0).findTypedAttribute<Imf::StringAttribute>("baton:renderer");
    return renderer == nullptr ? text->value() : text->value() + ' ' + renderer->value();
  } catch (const std::exception&) {  // of OpenEXR
    return std::nullopt;
  }
}

}  // namespace baton
