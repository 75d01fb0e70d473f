#include "common/scene/texture/image_reader.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <cctype>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <utility>

#include "common/base/file_stamp.h"
#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/image/exr_image.h"
#include "common/scene/texture/jpeg_form.h"
#include "common/scene/texture/reader/interface.h"

namespace baton {
namespace {

Error bad_image(const std::string& name, const std::string& what) {
  return {ErrorKind::bad_input, name + ": " + what};
}

struct Reader {
  BatonReadImage read;
};

/// The reader, from the library beside the program; loaded once and never unloaded.
const Result<Reader>& reader() {
  static const Result<Reader> loaded = []() -> Result<Reader> {
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    const std::string path = (program.parent_path() / "libbaton-images.so").string();
    void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* const entry = library != nullptr ? dlsym(library, kBatonReadImage) : nullptr;
    if (entry == nullptr)
      return Error{ErrorKind::internal,
                   fmt::format("cannot load what reads images: {}", dlerror())};
    return Reader{reinterpret_cast<BatonReadImage>(entry)};
  }();
  return loaded;
}

Status check_size(std::int64_t width, std::int64_t height, const PixelLimit& limit,
                  const std::string& name) {
  const auto max = limits::kMaxTextureSide;
  if (width < 1 || height < 1 || width > max || height > max)
    return bad_image(name, fmt::format("expected an image of 1 to {} pixels a side, got {} x {}",
                                       max, width, height));
  return limit.check(width, height, name);
}

/// Takes what the reader hands over.
struct Taker {
  const PixelLimit& limit;
  const std::string& name;
  Image image;
  Error fault;

  static float* accept(void* self, const BatonImageLayout* layout) {
    auto& taker = *static_cast<Taker*>(self);
    const Status fits = check_size(layout->width, layout->height, taker.limit, taker.name);
    if (!fits) {
      taker.fault = fits.error();
      return nullptr;
    }
    taker.image = {.width = layout->width,
                   .height = layout->height,
                   .channels = layout->channels,
                   .samples = {},
                   .is_integer = layout->is_integer != 0,
                   .has_alpha = layout->has_alpha != 0,
                   .is_associated = layout->is_associated != 0};
    taker.image.samples.resize(static_cast<std::size_t>(layout->width) *
                               static_cast<std::size_t>(layout->height) *
                               static_cast<std::size_t>(layout->channels));
    return taker.image.samples.data();
  }
  static void fail(void* self, const char* message) {
    auto& taker = *static_cast<Taker*>(self);
    std::string text = "not an image: ";
    // Messages have lines.
    for (const char* c = message; *c != '\0'; ++c)
      text += std::iscntrl(static_cast<unsigned char>(*c)) != 0 ? ' ' : *c;
    taker.fault = bad_image(taker.name, text);
  }
};

Result<Image> read(const std::string& file_name, std::optional<ByteView> bytes,
                   const std::string& name, const PixelLimit& limit) {
  const Result<Reader>& loaded = reader();
  if (!loaded) return loaded.error();
  Taker taker{.limit = limit, .name = name, .image = {}, .fault = {}};
  const BatonImageSink sink{&taker, &Taker::accept, &Taker::fail};
  const bool done = loaded->read(file_name.c_str(), bytes ? bytes->data() : nullptr,
                                 bytes ? bytes->size() : 0, &sink) != 0;
  if (!done) return taker.fault;
  return std::move(taker.image);
}

/// What formats that glTF files contain are called; the reader looks at names first.
std::string name_by_content(ByteView bytes) {
  const auto starts = [&](const char* magic) {
    const std::size_t size = std::strlen(magic);
    return bytes.size() >= size && std::memcmp(bytes.data(), magic, size) == 0;
  };
  if (starts("\x89PNG")) return "image.png";
  if (starts("\xFF\xD8")) return "image.jpg";
  return starts("RIFF") ? "image.webp" : "";
}

using FirstBytes = std::array<std::byte, 4>;

Result<FirstBytes> first_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  FirstBytes start{};
  file.read(reinterpret_cast<char*>(start.data()), start.size());
  if (file.bad() || !file.is_open()) return Error{ErrorKind::io, path + ": cannot read"};
  return start;
}

/// OpenImageIO opens the file itself, and takes an error of the moment for a broken one: what it
/// does not read it looks at again.
Result<Image> read_by_name(const std::string& path, const PixelLimit& limit) {
  Result<Image> image = read(path, std::nullopt, path, limit);
  return image ? std::move(image) : read(path, std::nullopt, path, limit);
}

bool is_exr(const FirstBytes& start) {
  return start == FirstBytes{std::byte{0x76}, std::byte{0x2f}, std::byte{0x31}, std::byte{0x01}};
}

/// What is read of the bytes of a JPEG file, with its notes.
Result<Image> with_notes(Result<Image> image, ByteView bytes) {
  if (image) image->notes = jpeg_notes(bytes);
  return image;
}

Result<Image> read_exr_texture(const std::string& path, const PixelLimit& limit) {
  constexpr std::int64_t kMost = std::int64_t{limits::kMaxTextureSide} * limits::kMaxTextureSide;
  const PixelLimit sides{kMost, fmt::format(", {} a side", limits::kMaxTextureSide)};
  BATON_ASSIGN(ExrImage picture,
               read_exr_image(path, ExrWindow::display, true, limit.most < kMost ? limit : sides));
  Image image{.width = picture.width,
              .height = picture.height,
              .channels = picture.channels,
              .samples = std::move(picture.samples),
              .has_alpha = picture.has_alpha,
              .is_associated = picture.has_alpha,
              .notes = std::move(picture.notes)};
  BATON_TRY(check_size(image.width, image.height, limit, path));
  if (const auto& c = picture.chromaticities)
    image.chromaticities = {c->red[0],  c->red[1],  c->green[0], c->green[1],
                            c->blue[0], c->blue[1], c->white[0], c->white[1]};
  return image;
}

}  // namespace

Result<Image> read_image(const std::string& path, const PixelLimit& limit) {
  BATON_ASSIGN(const std::optional<FileStamp> stamp, stamp_of(path));
  if (!stamp) return bad_image(path, "missing: expected an image file");
  BATON_ASSIGN(const FirstBytes start, first_bytes(path));
  if (is_exr(start)) return read_exr_texture(path, limit);
  if (!is_jpeg(start)) return read_by_name(path, limit);
  BATON_ASSIGN(const Bytes bytes, read_file(path, limits::kMaxAssetFileBytes));
  return with_notes(read_by_name(path, limit), bytes);
}

Result<Image> read_image(ByteView bytes, const std::string& name, const PixelLimit& limit) {
  const std::string file_name = name_by_content(bytes);
  if (file_name.empty()) return bad_image(name, "not an image: expected PNG, JPEG or WebP");
  Result<Image> image = read(file_name, bytes, name, limit);
  return is_jpeg(bytes) ? with_notes(std::move(image), bytes) : std::move(image);
}

}  // namespace baton
