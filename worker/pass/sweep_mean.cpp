#include "worker/pass/sweep_mean.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "common/image/cryptomatte.h"
#include "common/image/noise.h"
#include "common/job/aov.h"
#include "common/math/vec3.h"

namespace baton {
namespace {

/// The mean of `count` values and of one more.
float mean(float of_earlier, double count, float value) {
  return static_cast<float>((count * double{of_earlier} + double{value}) / (count + 1));
}
/// The variance of such a mean, from those of its parts.
float variance_of_mean(float of_earlier, double count, float value) {
  return static_cast<float>((count * count * double{of_earlier} + double{value}) /
                            ((count + 1) * (count + 1)));
}
/// Where it is not known of one, that of the other stands for both.
float error_of_mean(float of_earlier, double count, float value) {
  if (of_earlier < 0 && value < 0) return std::max(of_earlier, value);
  if (of_earlier < 0) return value;
  if (value < 0) return of_earlier;
  return variance_of_mean(of_earlier, count, value);
}

using Rule = float (*)(float of_earlier, double count, float value);
Rule rule_of(const std::string& channel) {
  if (channel == kErrorChannel) return error_of_mean;
  if (channel.starts_with("variance.")) return variance_of_mean;
  if (channel == "rounds")
    return [](float of_earlier, double, float value) { return of_earlier + value; };
  if (channel == "material" || channel == "object")
    return
        [](float of_earlier, double, float value) { return of_earlier > 0 ? of_earlier : value; };
  const bool of_surfaces = channel == "depth" || channel == "Z" || channel.starts_with("P.") ||
                           channel.starts_with("albedo.");
  if (of_surfaces) {
    return [](float of_earlier, double count, float value) {
      if (of_earlier == 0) return value;  // no surface, or black in both
      return value == 0 ? of_earlier : mean(of_earlier, count, value);
    };
  }
  return mean;
}

/// Mean normals have unit length, or are 0 where no sweep sees a surface.
void normalize_normals(FilmTile& film) {
  float *const x = film.find("normal.X"), *const y = film.find("normal.Y"),
               *const z = film.find("normal.Z");
  if (x == nullptr || y == nullptr || z == nullptr) return;
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    const Vec3 sum{x[i], y[i], z[i]};
    if (sum == Vec3{}) continue;
    const Vec3 normal = normalize(sum);
    x[i] = normal.x;
    y[i] = normal.y;
    z[i] = normal.z;
  }
}

}  // namespace

Status add_sweeps(FilmTile earlier, Sweep sweep, FilmTile& film) {
  const std::int32_t num_sweeps = sweep.value();  // that `earlier` is the mean of
  if (earlier.rect != film.rect || earlier.channels != film.channels) {
    return Error{ErrorKind::bad_input,
                 fmt::format("film of an earlier sweep: at {},{} with channels {}, expected {},{}, "
                             "{}",
                             earlier.rect.x0, earlier.rect.y0, fmt::join(earlier.channels, " "),
                             film.rect.x0, film.rect.y0, fmt::join(film.channels, " "))};
  }
  for (std::size_t channel = 0; channel < film.channels.size(); ++channel) {
    if (film.channels[channel].starts_with("Crypto")) continue;  // below, a layer at a time
    const Rule rule = rule_of(film.channels[channel]);
    const float* const before = earlier.plane(channel);
    float* const now = film.plane(channel);
    for (std::size_t i = 0; i < film.num_pixels(); ++i)
      now[i] = rule(before[i], num_sweeps, now[i]);
  }
  for (const Aov aov : {Aov::crypto_object, Aov::crypto_material})
    merge_cryptomatte(earlier, num_sweeps, traits(aov).channels, film);
  normalize_normals(film);
  return {};
}

}  // namespace baton
