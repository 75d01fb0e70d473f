#include "jobs/cli/render/progress.h"

#include <fmt/format.h>

#include <cstdio>

#include "jobs/cli/text.h"

namespace baton {
namespace {

constexpr std::chrono::seconds kLineInterval{5};

}  // namespace

std::string Progress::line(const JobSummary& job, TimePoint now) const {
  std::string text = fmt::format("frames {}/{}  tasks {}/{}", job.frames_done, job.frames_total,
                                 job.tasks_done, job.tasks_total);
  if (!start_ || job.tasks_done <= start_->tasks_done) return text;

  // Frames finish late, as a task renders several: the time left comes from the tasks.
  const double seconds = std::chrono::duration<double>(now - start_->time).count();
  const auto tasks = static_cast<double>(job.tasks_done - start_->tasks_done);
  text += fmt::format("  {:.2f} frames/s  {:.1f} tasks/s",
                      (job.frames_done - start_->frames_done) / seconds, tasks / seconds);
  if (job.tasks_done < job.tasks_total) {
    const auto left = static_cast<double>(job.tasks_total - job.tasks_done);
    text += fmt::format("  ETA {}", duration_text(left * seconds / tasks));
  }
  if (job.attempts_lost > 0) text += fmt::format("  {} attempts lost", job.attempts_lost);
  return text;
}

void Progress::update(const JobSummary& job, TimePoint now) {
  if (!start_) start_ = Start{now, job.tasks_done, job.frames_done};
  const bool last = !is_open(job.status);
  if (terminal_) {
    // Erase to the end of the line: the text before may have been longer.
    fmt::print(stderr, "\r{}\x1b[K", line(job, now));
    std::fflush(stderr);
    line_open_ = true;
  } else if (last || !last_shown_ || now - *last_shown_ >= kLineInterval) {
    fmt::print(stderr, "{}\n", line(job, now));
    last_shown_ = now;
  }
}

void Progress::finish() {
  if (line_open_) fmt::print(stderr, "\n");
  line_open_ = false;
}

}  // namespace baton
