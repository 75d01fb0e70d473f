#include "worker/pass/film_writer.h"

#include "common/image/shadow.h"
#include "common/job/aov.h"
#include "common/job/plan/sequence.h"

namespace baton {
Rgb source_color(PixelSource source) {
  // By PixelSource.
  constexpr std::array<Rgb, 6> kColors{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
  return kColors.at(static_cast<std::size_t>(source));
}

namespace {

/// A picture beside the picture: what it would be, or a part of it.
Rgb part_of_picture(Aov aov, const PixelResult& pixel) {
  if (aov == Aov::unshadowed) return pixel.radiance + pixel.blocked;
  if (aov == Aov::blocked) return pixel.blocked;
  return aov == Aov::indirect ? pixel.indirect : pixel.radiance - pixel.indirect;
}

}  // namespace

FilmWriter::FilmWriter(const PixelRect& rect, const JobSpec& job)
    : aovs_(job.output.aovs),
      with_indirect_(hides_indirect(job)),
      with_shadow_(has_catcher(job)),
      with_error_(tells_noise(job)) {
  film_.rect = rect;
  film_.channels = {"R", "G", "B", "A"};
  for (const Aov aov : aovs_) {
    for (const std::string& name : traits(aov).channels) film_.channels.push_back(name);
  }
  if (with_indirect_) {
    for (const std::string& name : traits(Aov::indirect).channels) film_.channels.push_back(name);
  }
  if (with_shadow_) {
    for (const char* const name : {"shadow.R", "shadow.G", "shadow.B", kCatcherChannel})
      film_.channels.emplace_back(name);
  }
  if (with_error_) film_.channels.emplace_back(kErrorChannel);
  film_.values.resize(film_.channels.size() * film_.num_pixels());
}

/// What frames have not, or not so.
void FilmWriter::write_hidden(std::size_t index, std::size_t channel, const PixelResult& pixel) {
  const auto put = [&](float value) { film_.plane(channel++)[index] = value; };
  const auto put_color = [&](const Rgb& v) {
    put(v.x);
    put(v.y);
    put(v.z);
  };
  if (with_indirect_) put_color(pixel.indirect);
  if (with_shadow_) {
    put_color(pixel.shadow);
    put(pixel.catcher);
  }
  if (with_error_) put(pixel.error);
}

void FilmWriter::write(std::size_t index, const PixelResult& pixel) {
  std::size_t channel = 0;
  const auto put = [&](float value) { film_.plane(channel++)[index] = value; };
  const auto put_vec = [&](const Vec3& v) {
    put(v.x);
    put(v.y);
    put(v.z);
  };
  put_vec(pixel.radiance);
  put(pixel.alpha);
  for (const Aov aov : aovs_) {
    switch (aov) {
      case Aov::lns:
        put(pixel.lns);
        break;
      case Aov::visibility:
        put(pixel.visibility);
        break;
      case Aov::ess:
        put(pixel.ess_ratio);
        break;
      case Aov::acceptance:
        put(pixel.acceptance);
        break;
      case Aov::source:
        put_vec(pixel.source_color);
        break;
      case Aov::normal:
        put_vec(pixel.normal);
        break;
      case Aov::depth:
        put(pixel.depth);
        break;
      case Aov::variance:
        put_vec(pixel.variance);
        break;
      case Aov::mask:
        put(pixel.mask);
        break;
      case Aov::acceptance_local:
        put(pixel.acceptance_local);
        break;
      case Aov::acceptance_independent:
        put(pixel.acceptance_independent);
        break;
      case Aov::resampled:
        put(pixel.resampled);
        break;
      case Aov::material:
        put(static_cast<float>(pixel.material));
        break;
      case Aov::rounds:
        put(pixel.rounds);
        break;
      case Aov::unshadowed:
      case Aov::blocked:
      case Aov::direct:
      case Aov::indirect:
        put_vec(part_of_picture(aov, pixel));
        break;
      case Aov::albedo:
      case Aov::position:
      case Aov::z:
      case Aov::motion:
      case Aov::object:
      case Aov::crypto_object:
      case Aov::crypto_material:
        channel += traits(aov).channels.size();  // GeometryPlanes fills them
        break;
    }
  }
  write_hidden(index, channel, pixel);
}

}  // namespace baton
