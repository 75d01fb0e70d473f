#include "common/job/empty_aovs.h"

#include "common/job/sequence.h"

namespace baton {

std::string_view why_empty(Aov aov, const JobSpec& job) {
  const Method method = job.sampling.method;
  switch (aov) {
    case Aov::acceptance:
    case Aov::acceptance_local:
    case Aov::acceptance_independent:
    case Aov::resampled:
      return traits(method).moves_samples ? "" : "only `sequential` fills it";
    case Aov::variance:
      return tells_noise(job) ? ""
                              : "samples that are carried, or that a second pass exchanges, tell "
                                "nothing of their error";
    case Aov::ess:
      return traits(method).keeps_samples ? "" : "the method's rays have no weights";
    default:
      return "";
  }
}

}  // namespace baton
