#include <fmt/format.h>
#include <meshoptimizer.h>

#include "common/base/limits.h"
#include "common/scene/gltf/compression.h"

namespace baton::gltf {
namespace {

struct Layout {
  std::size_t count, stride;
};

/// 0: done [EXT_meshopt_compression, appendix A].
int decode(const std::string& mode, const Layout& layout, ByteView from, Bytes& to) {
  const auto* const bytes = reinterpret_cast<const unsigned char*>(from.data());
  const auto [count, stride] = layout;
  if (mode == "TRIANGLES")
    return meshopt_decodeIndexBuffer(to.data(), count, stride, bytes, from.size());
  if (mode == "INDICES")
    return meshopt_decodeIndexSequence(to.data(), count, stride, bytes, from.size());
  return meshopt_decodeVertexBuffer(to.data(), count, stride, bytes, from.size());
}

/// What a mode and a filter take.
bool is_fair(const std::string& mode, const std::string& filter, const Layout& layout) {
  const auto [count, stride] = layout;
  if (mode == "TRIANGLES" || mode == "INDICES")
    return (stride == 2 || stride == 4) && (mode == "INDICES" || count % 3 == 0);
  if (mode != "ATTRIBUTES" || stride == 0 || stride % 4 != 0 || stride > 256) return false;
  if (filter == "OCTAHEDRAL") return stride == 4 || stride == 8;
  if (filter == "QUATERNION") return stride == 8;
  return filter.empty() || filter == "NONE" || filter == "EXPONENTIAL";
}

}  // namespace

void decode_meshopt_view(const JsonView& extension, ByteView bytes, Document& document,
                         View& view) {
  const Layout layout{extension.size("count"), extension.size("byteStride")};
  const std::string mode = extension.text("mode"), filter = extension.text("filter");
  if (layout.count > limits::kMaxAssetFileBytes / 256 || !is_fair(mode, filter, layout))
    return extension.fail(
        fmt::format("{} elements of {} bytes, mode \"{}\", filter \"{}\": expected "
                    "a layout of the extension",
                    layout.count, layout.stride, mode, filter));
  // What it is packed to is at least a 64th, and a few bytes.
  constexpr std::uint64_t kMostGrowth = 256, kFew = 1 << 16;
  if (layout.count * layout.stride > kMostGrowth * bytes.size() + kFew)
    return extension.fail(fmt::format("{} elements of {} bytes in {}: it is cut or damaged",
                                      layout.count, layout.stride, bytes.size()));
  Bytes decoded(layout.count * layout.stride);
  if (decode(mode, layout, bytes, decoded) != 0) return extension.fail("its data is damaged");
  if (filter == "OCTAHEDRAL") meshopt_decodeFilterOct(decoded.data(), layout.count, layout.stride);
  if (filter == "QUATERNION") meshopt_decodeFilterQuat(decoded.data(), layout.count, layout.stride);
  if (filter == "EXPONENTIAL") meshopt_decodeFilterExp(decoded.data(), layout.count, layout.stride);
  view.buffer = static_cast<int>(document.buffers.size());
  view.offset = 0;
  view.size = decoded.size();
  document.buffers.push_back(std::move(decoded));
}

}  // namespace baton::gltf
