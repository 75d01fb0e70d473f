// Reads images with OpenImageIO: a library of its own, which image_reader.cpp loads when it is
// needed.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>

#include <algorithm>
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

/// Reads a data window that is not the picture.
constexpr OIIO::imagesize_t kMostPixels = OIIO::imagesize_t{8192} * 8192;
/// A channel that a file lacks.
constexpr int kNone = -1;

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

/// "diffuse." of "diffuse.R".
std::string layer_of(const std::string& name) { return name.substr(0, name.rfind('.') + 1); }

/// The colours of an EXR file by their names: those of its first layer that has some. Empty: no
/// channel has such a name.
std::vector<int> named_colors(const OIIO::ImageSpec& spec) {
  const auto color_of = [](const std::string& name) {
    const std::string last = name.substr(layer_of(name).size());
    const auto is = [&](const char* word) { return OIIO::Strutil::iequals(last, word); };
    return is("R") || is("Red")     ? 0
           : is("G") || is("Green") ? 1
           : is("B") || is("Blue")  ? 2
                                    : kNone;
  };
  std::vector<int> colors;
  std::string layer;
  for (int c = 0; c < spec.nchannels; ++c) {
    const std::string& name = spec.channelnames[static_cast<std::size_t>(c)];
    const int color = color_of(name);
    if (color == kNone || (!colors.empty() && layer_of(name) != layer)) continue;
    layer = layer_of(name);
    if (static_cast<int>(colors.size()) <= color)
      colors.resize(static_cast<std::size_t>(color) + 1, kNone);
    colors[static_cast<std::size_t>(color)] = c;
  }
  return colors;
}

/// What of a file's channels is an image: alpha is what the file calls so, in the layer of the
/// colours; what else there is, such as depth, stays out.
Choice choose_channels(const std::string& format, const OIIO::ImageSpec& spec) {
  Choice choice;
  int alpha = spec.alpha_channel;
  // Where there are two channels, OpenImageIO names alpha in PNG and TIFF files alone.
  if (alpha < 0 && spec.nchannels == 2 && format != "openexr" && format != "tiff") alpha = 1;
  if (format == "openexr") choice.channels = named_colors(spec);
  if (!choice.channels.empty() && alpha >= 0) {
    const auto layer = [&](int c) {
      return layer_of(spec.channelnames[static_cast<std::size_t>(c)]);
    };
    if (layer(alpha) != layer(choice.channels.back())) alpha = kNone;
  }
  if (choice.channels.empty()) {
    std::vector<int> others;
    for (int c = 0; c < spec.nchannels; ++c)
      if (c != alpha) others.push_back(c);
    others.resize(others.size() < 3 ? std::min<std::size_t>(others.size(), 1) : 3);
    choice.channels = others;
  }
  // Alpha alone is grey.
  choice.has_alpha = alpha >= 0 && !choice.channels.empty();
  if (alpha >= 0) choice.channels.push_back(alpha);
  return choice;
}

/// Whether the colours that are read are multiplied by alpha, as is the convention of EXR files.
bool is_associated(const std::string& format, const OIIO::ImageSpec& spec) {
  if (spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0) return false;
  constexpr int kPremultipliedTarga = 4;
  return format == "openexr" || format == "tiff" ||
         (format == "targa" &&
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
    if (channel == kNone) continue;  // samples are 0
    if (!input.read_image(0, 0, channel, channel + 1, OIIO::TypeDesc::FLOAT, samples + k,
                          static_cast<OIIO::stride_t>(sizeof(float)) * count))
      return false;
  }
  return true;
}

/// The window of an EXR file that is its picture, which the data may not fill or exceed.
OIIO::ROI picture_of(const std::string& format, const OIIO::ImageSpec& spec) {
  return format == "openexr" ? spec.roi_full() : spec.roi();
}

bool are_same(const OIIO::ROI& a, const OIIO::ROI& b) {
  return a.xbegin == b.xbegin && a.xend == b.xend && a.ybegin == b.ybegin && a.yend == b.yend;
}

/// read_samples into the picture: the data inside of it, the rest stays.
bool read_picture(OIIO::ImageInput& input, const Choice& choice, const OIIO::ROI& picture,
                  float* samples) {
  const OIIO::ROI data = input.spec().roi();
  if (are_same(data, picture)) return read_samples(input, choice, samples);
  const auto count = choice.channels.size();
  const auto at = [&](const OIIO::ROI& in, int x, int y) {
    return (static_cast<std::size_t>(y - in.ybegin) * static_cast<std::size_t>(in.width()) +
            static_cast<std::size_t>(x - in.xbegin)) *
           count;
  };
  std::vector<float> all(at(data, data.xbegin, data.yend));
  if (!read_samples(input, choice, all.data())) return false;
  const int x0 = std::max(data.xbegin, picture.xbegin), x1 = std::min(data.xend, picture.xend);
  const int y0 = std::max(data.ybegin, picture.ybegin), y1 = std::min(data.yend, picture.yend);
  for (int y = y0; y < y1 && x0 < x1; ++y)
    std::copy_n(all.data() + at(data, x0, y), static_cast<std::size_t>(x1 - x0) * count,
                samples + at(picture, x0, y));
  return true;
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
  if (spec.nchannels < 1) return fail(sink, "expected channels");
  const std::string format = input->format_name();
  const Choice choice = choose_channels(format, spec);
  const bool has_alpha = choice.has_alpha;
  const OIIO::ROI picture = picture_of(format, spec);
  if (!are_same(picture, spec.roi()) && spec.image_pixels() > kMostPixels)
    return fail(sink, "expected a data window of at most 8192 x 8192 pixels");
  BatonImageLayout layout{.width = picture.width(),
                          .height = picture.height(),
                          .channels = static_cast<std::int32_t>(choice.channels.size()),
                          .has_alpha = has_alpha ? 1 : 0,
                          .is_associated = has_alpha && is_associated(format, spec) ? 1 : 0,
                          .is_integer = spec.format.is_floating_point() ? 0 : 1,
                          .has_chromaticities = 0,
                          .chromaticities = {}};
  const OIIO::TypeDesc eight(OIIO::TypeDesc::FLOAT, 8);
  if (format == "openexr" && spec.getattribute("chromaticities", eight, layout.chromaticities))
    layout.has_chromaticities = 1;
  float* const samples = sink.accept(sink.self, &layout);
  if (samples == nullptr) return 0;
  if (!read_picture(*input, choice, picture, samples)) return fail(sink, input->geterror());
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
