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
      if (traits(method).tells_variance()) return "";
      if (carries_state(job)) return "samples that are carried tell nothing of their error";
      return job.quality.rounds < 4 ? "only `reference`, `pool` and `ratio` fill it, and four "
                                      "rounds or more of the others"
                                    : "";
    case Aov::ess:
      return traits(method).keeps_samples ? "" : "the method's rays have no weights";
    default:
      return "";
  }
}

}  // namespace baton
