// Reads images with OpenImageIO: a library of its own, which image_reader.cpp loads when it is
// needed.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "common/scene/texture/reader/interface.h"

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

/// Channels of a file: colours in the order of red, green, blue, or one of grey; then alpha.
struct Choice {
  std::vector<int> channels;
  bool has_alpha = false;

  bool is_all_of(const OIIO::ImageSpec& spec) const {
    for (std::size_t i = 0; i < channels.size(); ++i)
      if (channels[i] != static_cast<int>(i)) return false;
    return static_cast<int>(channels.size()) == spec.nchannels;
  }
};

/// What of a file's channels is an image: alpha is what the file calls so.
Choice choose_channels(const std::string& format, const OIIO::ImageSpec& spec) {
  Choice choice;
  int alpha = spec.alpha_channel;
  // Where there are two channels, OpenImageIO names alpha in PNG and TIFF files alone.
  if (alpha < 0 && spec.nchannels == 2 && format != "tiff") alpha = 1;
  for (int c = 0; c < spec.nchannels; ++c)
    if (c != alpha) choice.channels.push_back(c);
  const std::size_t count = choice.channels.size();
  choice.channels.resize(count < 3 ? std::min<std::size_t>(count, 1) : 3);
  // Alpha alone is grey.
  choice.has_alpha = alpha >= 0 && !choice.channels.empty();
  if (alpha >= 0) choice.channels.push_back(alpha);
  return choice;
}

/// Whether the colours that are read are multiplied by alpha.
bool is_associated(const std::string& format, const OIIO::ImageSpec& spec) {
  if (spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0) return false;
  constexpr int kPremultipliedTarga = 4;
  return format == "tiff" || (format == "targa" &&
                              spec.get_int_attribute("targa:alpha_type", 0) == kPremultipliedTarga);
}

/// OpenImageIO 2.4 multiplies those of WebP files by alpha whatever it is asked for.
bool is_multiplied_unasked(const std::string& format, const OIIO::ImageSpec& spec) {
  return format == "webp" && spec.get_int_attribute("oiio:UnassociatedAlpha", 0) == 0;
}

void divide_by_alpha(float* samples, const BatonImageLayout& layout) {
  const auto channels = static_cast<std::size_t>(layout.channels);
  const std::size_t size =
      channels * static_cast<std::size_t>(layout.width) * static_cast<std::size_t>(layout.height);
  for (float* pixel = samples; pixel < samples + size; pixel += channels) {
    const float alpha = pixel[channels - 1];
    for (std::size_t c = 0; alpha > 0 && c + 1 < channels; ++c)
      pixel[c] = std::min(pixel[c] / alpha, 1.0f);
  }
}

/// False: it failed, and `input` says why.
bool read_samples(OIIO::ImageInput& input, const Choice& choice, float* samples) {
  const int count = static_cast<int>(choice.channels.size());
  if (choice.is_all_of(input.spec()))
    return input.read_image(0, 0, 0, count, OIIO::TypeDesc::FLOAT, samples);
  for (int k = 0; k < count; ++k) {
    const int channel = choice.channels[static_cast<std::size_t>(k)];
    if (!input.read_image(0, 0, channel, channel + 1, OIIO::TypeDesc::FLOAT, samples + k,
                          static_cast<OIIO::stride_t>(sizeof(float)) * count))
      return false;
  }
  return true;
}

int read(const char* name, const void* bytes, std::size_t size, const BatonImageSink& sink) {
  set_up_once();
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  std::unique_ptr<OIIO::Filesystem::IOProxy> memory;
  std::string shown = name;
  if (bytes != nullptr) {
    memory = std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<void*>(bytes), size);
  } else if (std::strchr(name, '?') != nullptr) {
    // In a name OpenImageIO takes what follows for settings.
    memory = std::make_unique<OIIO::Filesystem::IOFile>(name, OIIO::Filesystem::IOProxy::Read);
    shown = "image" + OIIO::Filesystem::extension(name);
  }
  if (memory != nullptr) {
    void* const proxy = memory.get();
    config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  }
  const auto input = OIIO::ImageInput::open(shown, &config, memory.get());
  if (input == nullptr) return fail(sink, OIIO::geterror());
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.deep || spec.depth > 1) return fail(sink, "expected a flat image");
  if (spec.nchannels < 1) return fail(sink, "expected channels");
  const std::string format = input->format_name();
  const Choice choice = choose_channels(format, spec);
  const bool has_alpha = choice.has_alpha;
  BatonImageLayout layout{.width = spec.width,
                          .height = spec.height,
                          .channels = static_cast<std::int32_t>(choice.channels.size()),
                          .has_alpha = has_alpha ? 1 : 0,
                          .is_associated = has_alpha && is_associated(format, spec) ? 1 : 0,
                          .is_integer = spec.format.is_floating_point() ? 0 : 1};
  float* const samples = sink.accept(sink.self, &layout);
  if (samples == nullptr) return 0;
  if (!read_samples(*input, choice, samples)) return fail(sink, input->geterror());
  if (has_alpha && is_multiplied_unasked(format, spec)) divide_by_alpha(samples, layout);
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
