#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace baton::test {

/// A small glTF file in the making: values are appended to its one buffer, the rest is JSON.
class GltfWriter {
 public:
  /// Appends values as an accessor of its own view; its index. more: further JSON of the accessor.
  template <class T>
  int add(const std::vector<T>& values, const std::string& type, int width,
          const std::string& more = "") {
    const int view = add_view(values);
    return add_accessor("\"bufferView\":" + std::to_string(view) +
                        ",\"componentType\":" + std::to_string(component<T>()) + ",\"count\":" +
                        std::to_string(values.size() / static_cast<std::size_t>(width)) +
                        ",\"type\":\"" + type + "\"" + more);
  }
  template <class T>
  int add_view(const std::vector<T>& values) {
    buffer_.resize((buffer_.size() + 3) / 4 * 4);
    const std::size_t at = buffer_.size(), size = values.size() * sizeof(T);
    buffer_.resize(at + size);
    std::memcpy(buffer_.data() + at, values.data(), size);
    append(views_, "{\"buffer\":0,\"byteOffset\":" + std::to_string(at) +
                       ",\"byteLength\":" + std::to_string(size) + "}");
    return num_views_++;
  }
  /// A view by its JSON.
  int add_raw_view(const std::string& json) {
    append(views_, "{" + json + "}");
    return num_views_++;
  }
  int add_accessor(const std::string& json) {
    append(accessors_, "{" + json + "}");
    return num_accessors_++;
  }

  /// The whole file; json: its members but asset, buffers, bufferViews and accessors.
  std::string glb(const std::string& json) const {
    std::string text = R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":)" +
                       std::to_string(buffer_.size()) + "}],\"bufferViews\":[" + views_ +
                       "],\"accessors\":[" + accessors_ + "]," + json + "}";
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string binary = buffer_;
    binary.resize((binary.size() + 3) / 4 * 4);
    std::string bytes = "glTF";
    put(bytes, 2);
    put(bytes, 12 + 8 + text.size() + 8 + binary.size());
    put(bytes, text.size());
    bytes += "JSON" + text;
    put(bytes, binary.size());
    return bytes + std::string("BIN\0", 4) + binary;
  }

 private:
  template <class T>
  static constexpr int component() {
    if (std::is_same_v<T, std::int8_t>) return 5120;
    if (std::is_same_v<T, std::uint8_t>) return 5121;
    if (std::is_same_v<T, std::int16_t>) return 5122;
    if (std::is_same_v<T, std::uint16_t>) return 5123;
    return std::is_same_v<T, std::uint32_t> ? 5125 : 5126;
  }
  static void append(std::string& list, const std::string& item) {
    list += (list.empty() ? "" : ",") + item;
  }
  static void put(std::string& bytes, std::size_t value) {
    const auto word = static_cast<std::uint32_t>(value);
    bytes.append(reinterpret_cast<const char*>(&word), sizeof(word));
  }

  std::string buffer_, views_, accessors_;
  int num_views_ = 0, num_accessors_ = 0;
};

/// A triangle in the plane z = 0 with edges of length 1 along x and y.
inline const std::vector<float> kTriangle{0, 0, 0, 1, 0, 0, 0, 1, 0};

/// A mesh of one primitive as JSON; attributes: such as "POSITION":0.
inline std::string mesh_json(const std::string& attributes, const std::string& more = "") {
  return R"("meshes":[{"primitives":[{"attributes":{)" + attributes + "}" + more + "}]}]";
}

}  // namespace baton::test
