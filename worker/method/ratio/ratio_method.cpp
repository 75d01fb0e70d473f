#include "worker/method/ratio/ratio_method.h"

#include "common/base/poison.h"
#include "common/state/sample_planes.h"
#include "worker/method/chosen/chosen_rays.h"
#include "worker/method/fresh/candidate_samplers.h"
#include "worker/method/ratio/ratio_kernels.h"

namespace baton {
namespace {

class RatioSampler final : public ChosenRaysSampler {
 public:
  using ChosenRaysSampler::ChosenRaysSampler;

  PixelDiagnostics sample(const PixelInput& input, const PixelState& pixel,
                          RayWriter& rays) override {
    poison(choice_);
    poison(rays_);
    const kernels::CandidateSource candidates =
        candidate_source(input, candidate_counts(input.sites, num_candidates_, lobe_fraction_));
    const float total = kernels::choose_ratio_rays(
        candidates, Rng(input.key, PassId::choose).uniforms(0, 0)[0], num_rays_, choice_, rays_);
    return write_chosen(total, candidates, PixelSource::fresh, input, pixel, rays);
  }

 private:
  kernels::ChoiceScratch choice_;
};

}  // namespace

PixelMethod make_ratio_method(const JobSpec& job) {
  return {.format = &sample_format(),
          .start = [spec = job.sampling] { return std::make_unique<RatioSampler>(spec); }};
}

}  // namespace baton
