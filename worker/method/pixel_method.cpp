#include "worker/method/pixel_method.h"

#include "worker/method/pool/pool_method.h"
#include "worker/method/populations.h"
#include "worker/method/ratio/ratio_method.h"
#include "worker/method/reference/reference.h"
#include "worker/method/weighted_method.h"

namespace baton {

std::unique_ptr<const PixelMethod> make_pixel_method(const JobSpec& job,
                                                     std::span<const Material> materials) {
  switch (job.sampling.method) {
    case Method::reference:
      return std::make_unique<ReferenceMethod>(job.sampling.reference_samples, materials);
    case Method::environment:
    case Method::brdf:
    case Method::mis:
    case Method::bidirectional:
      return std::make_unique<WeightedMethod>(job);
    case Method::sequential:
      return std::make_unique<SequentialMethod>(job);
    case Method::pool:
      return std::make_unique<PoolMethod>(job.sampling);
    case Method::ratio:
      return std::make_unique<RatioMethod>(job.sampling);
    case Method::restir:
      return std::make_unique<RestirMethod>(job);
    case Method::automatic:
      break;
  }
  return nullptr;
}

std::unique_ptr<const PixelMethod> make_material_method(const MaterialSampling& material) {
  JobSpec job;
  job.sampling = as_sampling(material);
  return std::make_unique<WeightedMethod>(job);
}

}  // namespace baton
