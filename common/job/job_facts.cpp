#include "common/job/job_facts.h"

#include <algorithm>

#include "common/job/aov.h"
#include "common/job/method.h"

namespace baton {

bool carries_state(const JobSpec& job) {
  return traits(job.sampling.method).carries() && job.state.carry;
}

bool asks_neighbors(const SamplingSpec& sampling) {
  return traits(sampling.method).asks_neighbors && sampling.num_neighbors > 0;
}

bool tells_noise(const JobSpec& job) {
  const bool carries_samples = carries_state(job) && traits(job.sampling.method).keeps_samples;
  return !carries_samples && !job.visibility.correlated;
}

bool draws_twice(const JobSpec& job) {
  return has_aov(job, Aov::variance) && job.quality.rounds == 1 && tells_noise(job) &&
         !(traits(job.sampling.method).tells_variance && job.light.bounces == 0);
}

bool hides_indirect(const JobSpec& job) {
  return job.visibility.correlated && job.light.bounces > 0 && !has_aov(job, Aov::indirect);
}

bool has_catcher(const JobSpec& job) { return !catcher_key(job).empty(); }

std::string catcher_key(const JobSpec& job) {
  const SceneSpec& scene = job.scene;
  if (scene.ground && scene.ground->catcher) return "scene.ground.catcher";
  const auto object = std::ranges::find_if(scene.objects, &ObjectSpec::catcher);
  if (object != scene.objects.end())
    return "scene.objects[" + std::to_string(object - scene.objects.begin()) + "].catcher";
  if (!scene.gltf) return {};
  const auto node =
      std::ranges::find_if(scene.gltf->nodes, [](const auto& item) { return item.second.catcher; });
  return node == scene.gltf->nodes.end() ? "" : "scene.gltf.nodes." + node->first + ".catcher";
}

SamplingSpec as_sampling(const MaterialSampling& material) {
  SamplingSpec spec;
  spec.method = material.method;
  spec.num_particles = material.num_particles;
  spec.num_candidates = material.num_candidates;
  spec.brdf_fraction = material.brdf_fraction;
  return spec;
}

std::int32_t num_carried_particles(const SamplingSpec& sampling) {
  return traits(sampling.method).keeps_samples ? most_particles(sampling) : 0;
}

std::int32_t most_particles(const SamplingSpec& sampling) {
  int most = sampling.num_particles;
  for (const auto& [name, material] : sampling.by_material)
    most = std::max(most, material.num_particles);
  return most;
}

bool rounds_have_own_sites(const JobSpec& job) {
  return !(carries_state(job) && traits(job.sampling.method).keeps_samples);
}

std::int32_t num_preroll_rounds(const JobSpec& job) {
  const bool learns = carries_state(job) && traits(job.sampling.method).carried == Carried::memory;
  return learns ? job.state.preroll : 0;
}

std::int32_t num_populations(const JobSpec& job) {
  return job.visibility.correlated && job.visibility.mask != MaskPolicy::same_samples ? 2 : 1;
}

std::int32_t exchange_reach_px(const VisibilitySpec& visibility) {
  return visibility.tile_size - 1 + visibility.dilate;
}

}  // namespace baton
