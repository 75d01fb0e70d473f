#include "common/image/exr_header.h"

#include <OpenEXR/ImfCompression.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <istream>
#include <streambuf>
#include <string_view>
#include <utility>

#include "common/base/limits.h"

namespace baton {
namespace {

constexpr std::uint32_t kMultiPart = 0x1000;

/// Bytes that are read as a file, where they lie.
class ViewBuffer : public std::streambuf {
 public:
  explicit ViewBuffer(ByteView bytes) {
    char* const begin = const_cast<char*>(reinterpret_cast<const char*>(bytes.data()));
    setg(begin, begin, begin + bytes.size());  // never written to
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type base = from == std::ios_base::beg   ? 0
                          : from == std::ios_base::cur ? gptr() - eback()
                                                       : egptr() - eback();
    return seekpos(base + offset, std::ios_base::in);
  }
  pos_type seekpos(pos_type place, std::ios_base::openmode) override {
    if (place < 0 || place > egptr() - eback()) return pos_type(off_type(-1));
    setg(eback(), eback() + static_cast<off_type>(place), egptr());
    return place;
  }
};

/// Little-endian.
std::uint32_t read_u32(std::istream& file) {
  std::uint32_t value = 0;
  file.read(reinterpret_cast<char*>(&value), sizeof(value));
  return file ? value : 0;
}

/// Bytes of a value of each type that has always so many; OpenEXR reads those, whatever the file
/// says.
constexpr std::pair<std::string_view, std::uint64_t> kSizes[] = {{"box2f", 16},
                                                                 {"box2i", 16},
                                                                 {"chromaticities", 32},
                                                                 {"compression", 1},
                                                                 {"deepImageState", 1},
                                                                 {"double", 8},
                                                                 {"envmap", 1},
                                                                 {"float", 4},
                                                                 {"int", 4},
                                                                 {"keycode", 28},
                                                                 {"lineOrder", 1},
                                                                 {"m33d", 72},
                                                                 {"m33f", 36},
                                                                 {"m44d", 128},
                                                                 {"m44f", 64},
                                                                 {"rational", 8},
                                                                 {"tiledesc", 9},
                                                                 {"timecode", 8},
                                                                 {"v2d", 16},
                                                                 {"v2f", 8},
                                                                 {"v2i", 8},
                                                                 {"v3d", 24},
                                                                 {"v3f", 12},
                                                                 {"v3i", 12}};

/// Goes to the end of a value as OpenEXR finds it. False: that is not where `size` puts it, or past
/// the end of the file.
bool skip_value(std::istream& file, std::string_view type, std::uint64_t size,
                std::uint64_t file_bytes) {
  const auto start = static_cast<std::uint64_t>(file.tellg());
  if (!file || size > file_bytes - start) return false;
  if (type == "chlist") {
    // Channels up to an empty name, each with 16 bytes.
    std::string name;
    while (std::getline(file, name, '\0') && !name.empty()) file.seekg(16, std::ios::cur);
    return file && static_cast<std::uint64_t>(file.tellg()) == start + size;
  }
  const auto known =
      std::ranges::find(kSizes, type, &std::pair<std::string_view, std::uint64_t>::first);
  file.seekg(static_cast<std::streamoff>(size), std::ios::cur);
  return known == std::end(kSizes) || known->second == size;
}

/// Whether a box at this place has sides that an image may have. The place stays.
bool is_fair_box(std::istream& file) {
  const auto start = file.tellg();
  std::array<std::int64_t, 4> edges{};  // x and y of one corner, then of the other
  for (std::int64_t& edge : edges) edge = static_cast<std::int32_t>(read_u32(file));
  file.seekg(start);
  const auto fits = [](std::int64_t low, std::int64_t high) {
    return high >= low && high - low < limits::kMaxImageSide;
  };
  return file && fits(edges[0], edges[2]) && fits(edges[1], edges[3]);
}

/// A header is attributes up to an empty name: name, type, both ended by a zero, a size and so many
/// bytes. A file of several parts has several headers, and an empty one behind them. visit(name):
/// at the value of each; an error of it ends this.
template <class Visit>
Status for_each_attribute(std::istream& file, std::uint64_t file_bytes, const std::string& path,
                          const Visit& visit) {
  read_u32(file);  // the magic number is for OpenEXR to check
  const bool multi_part = (read_u32(file) & kMultiPart) != 0;
  std::string name, type;
  while (true) {
    bool is_empty = true;
    while (std::getline(file, name, '\0') && !name.empty()) {
      is_empty = false;
      std::getline(file, type, '\0');
      const std::uint32_t size = read_u32(file);
      BATON_TRY(visit(name));
      if (!file || !skip_value(file, type, size, file_bytes)) {
        return Error{
            ErrorKind::bad_input,
            fmt::format("{}: not a readable EXR file: attribute {} is not as long as it says", path,
                        name)};
      }
    }
    if (is_empty || !multi_part || !file) return {};
  }
}

Status check_attributes(std::istream& file, std::uint64_t file_bytes, const std::string& path) {
  return for_each_attribute(file, file_bytes, path, [&](const std::string& name) -> Status {
    if (name != "dataWindow" || is_fair_box(file)) return {};
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: dataWindow: expected sides of 1 to {} pixels", path,
                             limits::kMaxImageSide)};
  });
}

}  // namespace

Status check_exr_attributes(const std::filesystem::path& path) {
  std::error_code error;
  const std::uint64_t file_bytes = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  return check_attributes(file, file_bytes, path.string());
}

Status check_exr_attributes(const std::string& name, ByteView exr) {
  ViewBuffer buffer(exr);
  std::istream file(&buffer);
  return check_attributes(file, exr.size(), name);
}

bool exceeds_reader(ByteView exr) {
  constexpr std::string_view kMagic = "\x76\x2f\x31\x01";
  if (!std::ranges::equal(exr.first(std::min(exr.size(), kMagic.size())), as_bytes_view(kMagic)))
    return false;
  ViewBuffer buffer(exr);
  std::istream file(&buffer);
  bool exceeds = false, is_ours = false;
  const Status whole =
      for_each_attribute(file, exr.size(), "", [&](const std::string& name) -> Status {
        is_ours = is_ours || name.starts_with("baton:");
        if (name == "dataWindow") exceeds = exceeds || !is_fair_box(file);
        if (name == "compression") exceeds = exceeds || file.peek() >= Imf::NUM_COMPRESSION_METHODS;
        return {};
      });
  return whole && exceeds && !is_ours;
}

}  // namespace baton
