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
/// The variance of such a mean by the scatter of its parts [Welford 1962]. of_earlier: that of the
/// earlier mean, which of a single one is not known.
float variance_of_mean(float of_earlier, float earlier, double count, float value) {
  const double before = count > 1 ? double{of_earlier} * count * (count - 1) : 0.0;
  const double step = double{value} - double{earlier};
  const double squares = before + step * step * count / (count + 1);
  return static_cast<float>(squares / (count * (count + 1)));
}

/// Variances and errors of the mean, of films whose colours are not yet mixed.
void tell_scatter(const FilmTile& earlier, double count, FilmTile& film) {
  float* const error = film.find(kErrorChannel);
  if (error == nullptr) return;  // what is carried from sweep to sweep is no scatter
  for (const char* const color : {"R", "G", "B"}) {
    const std::string layer = fmt::format("variance.{}", color);
    float* const variance = film.find(layer);
    if (variance == nullptr) continue;
    const float *const told = earlier.find(layer), *const before = earlier.find(color),
                       *const now = film.find(color);
    for (std::size_t i = 0; i < film.num_pixels(); ++i)
      variance[i] = variance_of_mean(told[i], before[i], count, now[i]);
  }
  const FilmColors before(earlier), now(film);
  const float* const told = earlier.find(kErrorChannel);
  for (std::size_t i = 0; i < film.num_pixels(); ++i) {
    if (told[i] == kNoSurface && error[i] == kNoSurface) continue;
    error[i] = variance_of_mean(std::max(told[i], 0.0f), static_cast<float>(before.grey(i)), count,
                                static_cast<float>(now.grey(i)));
  }
}

using Rule = float (*)(float of_earlier, double count, float value);
Rule rule_of(const std::string& channel) {
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
  tell_scatter(earlier, num_sweeps, film);
  for (std::size_t channel = 0; channel < film.channels.size(); ++channel) {
    const std::string& name = film.channels[channel];
    if (name.starts_with("Crypto")) continue;  // below, a layer at a time
    if (name == kErrorChannel || name.starts_with("variance.")) continue;
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
