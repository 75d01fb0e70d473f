#include "worker/pass/geometry_planes.h"

#include <algorithm>
#include <map>
#include <string_view>

#include "common/image/cryptomatte.h"
#include "common/job/aov.h"

namespace baton {

GeometryPlanes::GeometryPlanes(const RenderContext& context, const FrameSpec& frame,
                               const FrameGeometry& geometry, const PixelRect& rect)
    : context_(context), geometry_(geometry) {
  const std::vector<Aov>& aovs = context.job.output.aovs;
  if (std::ranges::none_of(aovs, [](Aov aov) { return traits(aov).of_geometry; })) return;
  const auto num_pixels = static_cast<std::size_t>(rect.area());
  sums_.resize(num_pixels);
  if (has(Aov::crypto_object)) {
    objects_.resize(num_pixels);
    object_names_ = object_names(context.job);
    std::map<std::string_view, std::uint32_t> first;
    for (const std::string& name : object_names_)
      first_parts_.push_back(
          first.emplace(name, static_cast<std::uint32_t>(first_parts_.size() + 1)).first->second);
  }
  if (has(Aov::crypto_material)) materials_.resize(num_pixels);
  if (has(Aov::motion)) {
    before_ = pose_at(*context.scene, context.job, frame.number.value() - 1);
    after_ = pose_at(*context.scene, context.job, frame.number.value() + 1);
  }
}

bool GeometryPlanes::has(Aov aov) const { return has_aov(context_.job, aov); }

void GeometryPlanes::Things::add(std::uint32_t number, double weight) {
  for (std::size_t i = 0; i < kMostThings; ++i) {
    if (thing[i] != number && thing[i] != 0) continue;
    thing[i] = number;
    sites[i] += weight;
    return;
  }
}

/// From where the point is in the image to where it is one frame later, and before; what is behind
/// the camera then is left out. The sky is infinitely far away.
void GeometryPlanes::add_motion(const Camera& camera, const Ray& ray, const SurfaceHit& hit,
                                double weight, Sum& sum) const {
  const auto place_in = [&](const Pose& pose) {
    if (!hit.hit) return pose.camera.project_direction(ray.direction);
    return pose.camera.project(geometry_.point_in(pose, hit));
  };
  const auto here =
      hit.hit ? camera.project(hit.point.position) : camera.project_direction(ray.direction);
  std::size_t at = 0;
  for (const Pose* pose : {&after_, &before_}) {
    const auto there = place_in(*pose);
    if (here && there) {
      sum.motion[at] += weight * (double{(*there)[0]} - double{(*here)[0]});
      sum.motion[at + 1] -= weight * (double{(*there)[1]} - double{(*here)[1]});  // v goes up
    }
    at += 2;
  }
}

void GeometryPlanes::add(const TileSurfaces& surfaces) {
  if (is_empty()) return;
  const Camera& camera = geometry_.pose.camera;
  const bool with_albedo = has(Aov::albedo), with_motion = has(Aov::motion);
  for (std::size_t slot = 0; slot < surfaces.pixels.size(); ++slot) {
    const std::size_t pixel = surfaces.pixels.index(slot);
    const double weight = surfaces.pixels.weight(slot);
    Sum& sum = sums_[pixel];
    sum.sites += weight * static_cast<double>(surfaces.num_sites(slot));
    for (std::size_t at = surfaces.first_hit[slot]; at < surfaces.first_hit[slot + 1]; ++at) {
      const SurfaceHit& hit = surfaces.hits[at];
      if (with_motion) add_motion(camera, surfaces.rays[at], hit, weight, sum);
      if (!hit.hit || hit.is_catcher) continue;
      sum.seen += weight;
      if (sum.object == 0) sum.object = hit.instance + 1;
      const Vec3& p = hit.point.position;
      sum.position[0] += weight * double{p.x};
      sum.position[1] += weight * double{p.y};
      sum.position[2] += weight * double{p.z};
      sum.z += weight * double{camera.distance_ahead(p)};
      if (!objects_.empty()) objects_[pixel].add(first_parts_[hit.instance], weight);
      if (!materials_.empty()) materials_[pixel].add(hit.material + 1, weight);
      if (!with_albedo) continue;
      const Material material = geometry_.see(hit, surfaces.shading(at)).material;
      sum.albedo[0] += weight * (double{material.kd.x} + double{material.ks.x});
      sum.albedo[1] += weight * (double{material.kd.y} + double{material.ks.y});
      sum.albedo[2] += weight * (double{material.kd.z} + double{material.ks.z});
    }
  }
}

void GeometryPlanes::write_ids(const std::vector<Things>& things,
                               const std::vector<std::string>& names, Aov layer,
                               FilmTile& film) const {
  std::vector<float> ids;
  for (const std::string& name : names) ids.push_back(cryptomatte_id(name));
  const CryptoLayer planes(film, traits(layer).channels);
  std::vector<CryptoShare> shares;
  for (std::size_t pixel = 0; pixel < things.size(); ++pixel) {
    shares.clear();
    for (std::size_t i = 0; i < kMostThings && things[pixel].thing[i] != 0; ++i) {
      shares.push_back(
          {ids.at(things[pixel].thing[i] - 1),
           static_cast<float>(things[pixel].sites[i]) / static_cast<float>(sums_[pixel].sites)});
    }
    planes.write(pixel, shares);
  }
}

void GeometryPlanes::write(FilmTile& film) const {
  if (is_empty()) return;
  const auto fill = [&](Aov aov, std::size_t channel, auto value_of) {
    if (!has(aov)) return;
    float* const plane = film.find(traits(aov).channels[channel]);
    for (std::size_t pixel = 0; pixel < sums_.size(); ++pixel)
      plane[pixel] = static_cast<float>(value_of(sums_[pixel]));
  };
  const auto mean = [](double sum, const Sum& pixel) {
    return pixel.seen > 0 ? sum / pixel.seen : 0;
  };
  for (std::size_t c = 0; c < 3; ++c) {
    fill(Aov::albedo, c, [&](const Sum& sum) { return mean(sum.albedo[c], sum); });
    fill(Aov::position, c, [&](const Sum& sum) { return mean(sum.position[c], sum); });
  }
  fill(Aov::z, 0, [&](const Sum& sum) { return mean(sum.z, sum); });
  for (std::size_t c = 0; c < 4; ++c)
    fill(Aov::motion, c, [&](const Sum& sum) { return sum.motion[c] / sum.sites; });
  fill(Aov::object, 0, [](const Sum& sum) { return static_cast<double>(sum.object); });
  if (!objects_.empty()) write_ids(objects_, object_names_, Aov::crypto_object, film);
  if (!materials_.empty())
    write_ids(materials_, material_names(context_.job), Aov::crypto_material, film);
}

}  // namespace baton
