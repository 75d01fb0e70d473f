#include "worker/pass/render_context.h"

#include "common/job/motion.h"
#include "worker/pass/populations.h"

namespace baton {

Result<std::shared_ptr<const RenderContext>> load_render_context(const JobSpec& job, const Digest& job_digest) {
  BATON_TRY(check_settled(job));
  auto context = std::make_shared<RenderContext>();
  context->job = job;
  context->digest = job_digest;
  context->grid = TileGrid(job.image);
  context->frames = expand_sequence(job);
  context->lights = std::make_unique<LightSequence>(context->job);
  context->sampler = make_pixel_sampler(population_spec(job));

  BATON_ASSIGN(Scene scene, load_scene(job));
  context->scene = std::make_unique<const Scene>(std::move(scene));
  BATON_ASSIGN(context->geometry, GeometrySequence::build(context->job, *context->scene));
  return std::shared_ptr<const RenderContext>(std::move(context));
}

std::vector<std::string> repair_notes(const RenderContext& context) { return context.lights->repair_notes(); }

std::string instruction_set() { return kernels::instruction_set(); }

}  // namespace baton
