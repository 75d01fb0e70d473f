#include "common/scene/gltf/accessor.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "common/base/limits.h"

namespace baton::gltf {
namespace {

/// Elements in a view: where they begin and how far apart they are.
struct Elements {
  const std::byte* first = nullptr;
  std::size_t stride = 0;
};

template <class T>
T load(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));  // little-endian, as the machine
  return value;
}

template <class T>
double load_number(const std::byte* at, bool normalized) {
  const T value = load<T>(at);
  if (!normalized) return static_cast<double>(value);
  constexpr double kMost = std::numeric_limits<T>::max();
  return std::max(static_cast<double>(value) / kMost, -1.0);
}

double load_component(const std::byte* at, Component component, bool normalized) {
  constexpr std::array kLoad{load_number<std::int8_t>,   load_number<std::uint8_t>,
                             load_number<std::int16_t>,  load_number<std::uint16_t>,
                             load_number<std::uint32_t>, load_number<float>};
  return kLoad.at(static_cast<std::size_t>(component))(at,
                                                       normalized && component <= Component::u16);
}

/// Reads accessors of one file.
class Reader {
 public:
  explicit Reader(const Document& document, int accessor)
      : document_(document),
        index_(accessor),
        accessor_(document.accessors[static_cast<std::size_t>(accessor)]) {}

  /// store(element, component, value), sparse elements last.
  template <class Store>
  Status each(const Store& store) const {
    const auto width = static_cast<std::size_t>(accessor_.width);
    const auto size = static_cast<std::size_t>(size_of(accessor_.component));
    const auto store_element = [&](std::size_t element, const std::byte* at) {
      for (std::size_t c = 0; c < width; ++c)
        store(element, c, load_component(at + c * size, accessor_.component, accessor_.normalized));
    };
    if (accessor_.view >= 0) {
      BATON_ASSIGN(const Elements elements,
                   locate(accessor_.view, accessor_.offset, accessor_.count, width * size));
      for (std::size_t i = 0; i < accessor_.count; ++i)
        store_element(i, elements.first + i * elements.stride);
    }
    if (accessor_.sparse.count == 0) return {};
    const Sparse& sparse = accessor_.sparse;
    const auto index_size = static_cast<std::size_t>(size_of(sparse.indices_component));
    BATON_ASSIGN(const Elements indices,
                 locate(sparse.indices, sparse.indices_offset, sparse.count, index_size));
    BATON_ASSIGN(const Elements values,
                 locate(sparse.values, sparse.values_offset, sparse.count, width * size));
    for (std::size_t i = 0; i < sparse.count; ++i) {
      const double at =
          load_component(indices.first + i * indices.stride, sparse.indices_component, false);
      if (!(at >= 0 && at < static_cast<double>(accessor_.count)))
        return fault(fmt::format("expected sparse indices below {}, got {}", accessor_.count, at));
      store_element(static_cast<std::size_t>(at), values.first + i * values.stride);
    }
    return {};
  }

  Status check(int width) const {
    if (accessor_.width != width)
      return fault(fmt::format("expected {} numbers an element, got {}", width, accessor_.width));
    // Where nothing is stored, nothing bounds the count but what the others have: a file of a few
    // bytes would take gigabytes.
    std::uint64_t most = kMostOfNothing;
    for (const Bytes& buffer : document_.buffers) most += buffer.size();
    if (accessor_.view < 0 && accessor_.count > most)
      return fault(fmt::format("expected at most {} elements that are not stored, got {}", most,
                               accessor_.count));
    if (accessor_.view >= 0) {
      BATON_ASSIGN([[maybe_unused]] const Elements elements,
                   locate(accessor_.view, accessor_.offset, accessor_.count,
                          static_cast<std::size_t>(width * size_of(accessor_.component))));
    }
    return {};
  }

  Error fault(const std::string& what) const {
    return document_.error(fmt::format("$.accessors[{}]: {}", index_, what));
  }

 private:
  static constexpr std::uint64_t kMostOfNothing = 1 << 20;
  /// `count` elements of `size` bytes, all within the view.
  Result<Elements> locate(int view_index, std::uint64_t offset, std::uint64_t count,
                          std::size_t size) const {
    const View& view = document_.views[static_cast<std::size_t>(view_index)];
    const std::uint64_t stride = view.stride == 0 ? size : view.stride;
    if (stride > limits::kMaxGltfStride)
      return fault(fmt::format("expected a stride of at most {} bytes, got {}",
                               limits::kMaxGltfStride, stride));
    const std::uint64_t end = count == 0 ? 0 : offset + (count - 1) * stride + size;
    if (end > view.size)
      return fault(
          fmt::format("{} elements end at byte {} of a view of {} bytes", count, end, view.size));
    const Bytes& buffer = document_.buffers[static_cast<std::size_t>(view.buffer)];
    return Elements{buffer.data() + (count == 0 ? 0 : view.offset + offset), stride};
  }

  const Document& document_;
  int index_;
  const Accessor& accessor_;
};

}  // namespace

Result<std::vector<float>> read_floats(const Document& document, int accessor, int width) {
  const Reader reader(document, accessor);
  BATON_TRY(reader.check(width));
  const auto components = static_cast<std::size_t>(width);
  std::vector<float> values(document.accessors[static_cast<std::size_t>(accessor)].count *
                            components);
  BATON_TRY(reader.each([&](std::size_t element, std::size_t c, double value) {
    values[element * components + c] = static_cast<float>(value);
  }));
  return values;
}

Result<std::vector<std::uint32_t>> read_indices(const Document& document, int accessor) {
  const Reader reader(document, accessor);
  BATON_TRY(reader.check(1));
  const Accessor& given = document.accessors[static_cast<std::size_t>(accessor)];
  if (given.component != Component::u8 && given.component != Component::u16 &&
      given.component != Component::u32)
    return reader.fault("expected indices without sign");
  std::vector<std::uint32_t> values(given.count);
  BATON_TRY(reader.each([&](std::size_t element, std::size_t, double value) {
    values[element] = static_cast<std::uint32_t>(value);
  }));
  return values;
}

bool is_finite(std::span<const float> values, std::size_t width, std::size_t index) {
  return std::ranges::all_of(values.subspan(index * width, width),
                             [](float v) { return std::isfinite(v); });
}

}  // namespace baton::gltf
