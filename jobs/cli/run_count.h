#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "common/job/job_spec.h"

namespace baton {

/// One line on stderr that says now and then how far a list of jobs is, which may grow: on a
/// terminal it is written over, elsewhere once in five seconds.
class RunCount {
 public:
  /// label: what is counted, "runs" or "trying". expected_frames: how many there will be in all, as
  /// far as is known before the jobs are; 0: those of the jobs.
  explicit RunCount(std::string label = "runs", std::size_t expected_frames = 0)
      : label_(std::move(label)), expected_frames_(expected_frames) {}

  /// Adds jobs that are to be done; returns the place of the first.
  std::size_t add(const std::vector<JobSpec>& jobs);
  void has_frames(std::size_t job, std::size_t done) { frames_done_[job] = done; }
  void job_done() { ++jobs_done_; }
  void update();
  /// Nothing more will come: the last word.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;

  void print(std::size_t all_frames, Clock::time_point now, const char* end) const;
  std::size_t num_done() const;

  std::string label_;
  std::size_t expected_frames_, num_frames_ = 0, jobs_done_ = 0;
  std::vector<std::size_t> frames_done_;  ///< by job
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_;
};

}  // namespace baton
