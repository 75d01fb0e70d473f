#include "jobs/cli/render/progress.h"

#include <fmt/format.h>

#include <cstdio>

#include "jobs/cli/job_summary.h"

namespace baton {
namespace {

constexpr std::chrono::seconds kLineInterval{5};

}  // namespace

std::string Progress::line(const JobSummary& job, const Eta& eta, TimePoint now) const {
  std::string text = fmt::format("frames {}/{}  tasks {}/{}", job.frames_done, job.frames_total,
                                 job.tasks_done, job.tasks_total);
  if (!start_ || job.tasks_done <= start_->tasks_done) return text;

  const double seconds = std::chrono::duration<double>(now - start_->time).count();
  text += fmt::format("  {:.2f} frames/s  {:.1f} tasks/s",
                      (job.frames_done - start_->frames_done) / seconds,
                      static_cast<double>(job.tasks_done - start_->tasks_done) / seconds);
  if (job.tasks_done < job.tasks_total) text += "  " + eta_text(eta);
  if (job.attempts_lost > 0) text += fmt::format("  {} attempts lost", job.attempts_lost);
  return text;
}

void Progress::update(const JobSummary& job, const Eta& eta, TimePoint now) {
  if (!start_) start_ = Start{now, job.tasks_done, job.frames_done};
  const bool last = !is_open(job.status);
  if (terminal_) {
    // Erase to the end of the line: the text before may have been longer.
    fmt::print(stderr, "\r{}\x1b[K", line(job, eta, now));
    std::fflush(stderr);
    line_open_ = true;
  } else if (last || !last_shown_ || now - *last_shown_ >= kLineInterval) {
    fmt::print(stderr, "{}\n", line(job, eta, now));
    last_shown_ = now;
  }
}

void Progress::finish() {
  if (line_open_) fmt::print(stderr, "\n");
  line_open_ = false;
}

}  // namespace baton
