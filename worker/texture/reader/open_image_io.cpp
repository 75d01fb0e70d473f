// Reads images with OpenImageIO: a library of its own, which image_reader.cpp loads when it is
// needed.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <exception>
#include <memory>
#include <string>

#include "worker/texture/reader/interface.h"

namespace {

/// One thread: the program has its own, and results must not depend on their number.
void set_up_once() {
  static const bool done = [] {
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
    return true;
  }();
  (void)done;
}

int fail(const BatonImageSink& sink, const std::string& message) {
  sink.fail(sink.self, message.empty() ? "unknown format" : message.c_str());
  return 0;
}

int read(const char* name, const void* bytes, std::size_t size, const BatonImageSink& sink) {
  set_up_once();
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  std::unique_ptr<OIIO::Filesystem::IOProxy> memory;
  if (bytes != nullptr) {
    memory = std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<void*>(bytes), size);
    void* const proxy = memory.get();
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  }
  const auto input = OIIO::ImageInput::open(name, &config, memory.get());
  if (input == nullptr) return fail(sink, OIIO::geterror());
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.deep || spec.depth > 1) return fail(sink, "expected a flat image");
  const BatonImageLayout layout{spec.width, spec.height, spec.nchannels,
                                spec.format.is_floating_point() ? 0 : 1};
  float* const samples = sink.accept(sink.self, &layout);
  if (samples == nullptr) return 0;
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, samples))
    return fail(sink, input->geterror());
  return 1;
}

}  // namespace

extern "C" int baton_read_image(const char* name, const void* bytes, std::size_t size,
                                const BatonImageSink* sink) {
  // No exception leaves the library.
  try {
    return read(name, bytes, size, *sink);
  } catch (const std::exception& e) {
    return fail(*sink, e.what());
  } catch (...) {
    return fail(*sink, "unknown fault");
  }
}
