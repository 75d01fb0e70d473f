#pragma once

#include <functional>
#include <string>
#include <vector>

#include "jobs/lab/stability/laws.h"
#include "jobs/lab/stability/stage.h"
#include "worker/method/pixel_method.h"

namespace baton::stability {

/// How long the sequences are and how often they are repeated with another seed.
struct Effort {
  int frames = 200;
  int runs = 6;
  /// All quadrature nodes of the case, else half as many each way.
  bool fine = true;
};
inline constexpr Effort kFullEffort{200, 6, true};
/// For ./run test.
inline constexpr Effort kQuickEffort{40, 6, false};

/// The length of one case's sequence. Frames are numbered from 1.
struct Timeline {
  int frames = 0;
  /// The frame in which the light jumps, 0: it does not.
  int event = 0;
  /// First frame of the late window.
  int late() const { return frames - frames / 4 + 1; }
  /// The frames that are compared with the exact answer, ascending: the first two, pairs spread
  /// over the sequence, those about the jump, four pairs in the late window.
  std::vector<FrameNumber> judged() const;
};

/// One way to make samplers stumble: a small job, what it tries, and what must be so.
struct Case {
  std::string name;
  std::string text;  ///< one sentence for the report
  /// Frames are set by the caller.
  std::function<JobSpec(const Stage&, const Timeline&)> build{};
  std::vector<Law> laws{};
  /// The light jumps at three tenths of the sequence.
  bool jumps = false;
  int stretch = 1;  ///< so many times the usual number of frames
  /// Multiple of 4: quadrature nodes per texel side.
  int nodes = 4;
  bool quick = false;  ///< also in the reduced form
  Timeline timeline(const Effort& effort) const;
};

/// What every method should keep everywhere. Noise is relative to fresh samples: a factor of 2 is 4
/// times the cost for the same error.
std::vector<Law> usual_laws();

/// The cases in which camera or objects move (moving_cases.cpp).
std::vector<Case> moving_cases();

/// Every case of the suite, in the order of the report.
std::vector<Case> all_cases();

/// What a case is tried with: a method and its settings.
struct Subject {
  std::string name;
  std::function<void(JobSpec&)> configure;
  /// Set in tests of the machinery only: replaces the product's method.
  std::function<PixelMethod(const JobSpec&)> method{};
};

/// Every value of Method but `automatic` with its default settings, then the published forms of the
/// sequential sampler and variants.
std::vector<Subject> all_subjects();
/// The name of the method that others are compared with.
inline constexpr const char* kFreshSubject = "bidirectional";

}  // namespace baton::stability
