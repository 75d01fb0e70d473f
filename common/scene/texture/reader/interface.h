#pragma once

#include <cstddef>
#include <cstdint>

/// Between the program and the library that is loaded for images (open_image_io.cpp). Only plain
/// types: nothing of OpenImageIO is known outside of it.
extern "C" {

struct BatonImageLayout {
  std::int32_t width, height;
  /// Colours, in the order of red, green, blue, or grey; then alpha.
  std::int32_t channels;
  std::int32_t has_alpha;
  std::int32_t is_associated;  ///< colours are multiplied by alpha
  std::int32_t is_integer;
};

/// Where an image goes.
struct BatonImageSink {
  void* self;
  /// Room for height * width * channels floats, which are 0; null: it does not want such an image.
  float* (*accept)(void* self, const BatonImageLayout* layout);
  void (*fail)(void* self, const char* message);
};

/// bytes: the file, or null to read it from `name`. 0: it failed and said why, or the sink refused.
using BatonReadImage = int (*)(const char* name, const void* bytes, std::size_t size,
                               const BatonImageSink* sink);
inline constexpr const char* kBatonReadImage = "baton_read_image";
}
