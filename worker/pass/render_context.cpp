#include "worker/pass/render_context.h"

#include <algorithm>
#include <iterator>

#include "common/job/motion.h"
#include "common/scene/object_view.h"
#include "worker/pass/primary.h"
#include "worker/pass/shared_assets.h"
#include "worker/surface/hidden_light.h"
#include "worker/surface/scene_kernels.h"

namespace baton {
namespace {

/// The method of each material that has a setting of its own, beside methods that draw anew.
std::vector<PixelMethod> make_own_methods(const JobSpec& job) {
  std::vector<PixelMethod> methods;
  for (const auto& [name, material] : job.scene.materials) {
    const auto own = job.sampling.by_material.find(name);
    const bool is_used =
        traits(job.sampling.method).draws_anew && own != job.sampling.by_material.end();
    methods.push_back(is_used ? make_material_method(own->second) : PixelMethod{});
  }
  return methods;
}

}  // namespace

Result<std::shared_ptr<const RenderContext>> load_render_context(const JobSpec& job,
                                                                 const Digest& picture) {
  BATON_ASSIGN(const auto assets, load_shared_assets(job));
  return make_render_context(job, picture, assets);
}

Result<std::shared_ptr<const RenderContext>> make_render_context(
    const JobSpec& job, const Digest& picture, const std::shared_ptr<const SharedAssets>& assets,
    const MemoryBudget& memory) {
  BATON_TRY(check_settled(job));
  auto context = std::make_shared<RenderContext>();
  context->job = job;
  context->picture = picture;
  context->grid = TileGrid(job.image);
  context->frames = expand_sequence(job);
  context->scene = std::shared_ptr<const Scene>(assets, &assets->scene);
  context->lights = std::make_unique<LightSequence>(
      context->job, assets->maps, memory.light,
      std::make_shared<const HiddenLight>(context->job, *context->scene));
  context->surfaces = std::make_shared<SurfaceCache>(memory.surfaces);
  context->method = make_pixel_method(context->job);
  context->own_methods = make_own_methods(job);
  context->geometry = std::make_unique<GeometrySequence>(context->job, *context->scene,
                                                         assets->accel, memory.surfaces);
  return std::shared_ptr<const RenderContext>(std::move(context));
}

Rgb gather_sites(const FrameGeometry& geometry, std::span<const SurfaceHit> hits,
                 std::span<const SurfaceShading> shadings, SiteBlock& sites,
                 CatcherAlbedo& catchers) {
  Rgb emission;
  sites.clear(static_cast<int>(hits.size()));
  for (std::size_t s = 0; s < hits.size(); ++s) {
    if (hits[s].hit) {
      emission += catchers.add_to(sites, static_cast<int>(s), geometry, hits[s],
                                  shadings.empty() ? nullptr : &shadings[s]);
    } else {
      sites.add_miss(static_cast<int>(s));
    }
  }
  return emission / static_cast<float>(hits.size());
}

std::vector<std::string> asset_notes(const RenderContext& context, const TaskKey& task) {
  std::vector<std::string> notes = context.lights->notes();
  if (task.position == 0 && task.tile == 0)
    std::ranges::move(geometry_warnings(context.job, *context.scene), std::back_inserter(notes));
  return notes;
}

std::string instruction_set() { return kernels::instruction_set(); }

}  // namespace baton
