#include "jobs/cli/run_count.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <numeric>

#include "jobs/cli/text.h"

namespace baton {
namespace {

constexpr std::chrono::milliseconds kCountIntervalOnTerminal{100};
constexpr std::chrono::seconds kCountInterval{5};

bool on_terminal() { return ::isatty(STDERR_FILENO) == 1; }

}  // namespace

std::size_t RunCount::add(const std::vector<JobSpec>& jobs) {
  const std::size_t first = frames_done_.size();
  for (const JobSpec& job : jobs) num_frames_ += job.frames.size();
  frames_done_.resize(first + jobs.size());
  return first;
}

std::size_t RunCount::num_done() const {
  return std::accumulate(frames_done_.begin(), frames_done_.end(), std::size_t{0});
}

void RunCount::update() {
  const Clock::time_point now = Clock::now();
  if (now < next_) return;
  const bool terminal = on_terminal();
  next_ = now + (terminal ? std::chrono::milliseconds(kCountIntervalOnTerminal) : kCountInterval);
  print(std::max(num_frames_, expected_frames_), now, terminal ? "\x1b[K" : "\n");
}

void RunCount::finish() {
  if (!frames_done_.empty()) print(num_done(), Clock::now(), "\n");
  frames_done_.clear();
}

void RunCount::print(std::size_t all_frames, Clock::time_point now, const char* end) const {
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const std::size_t done = num_done();
  const auto left = static_cast<double>(all_frames - std::min(all_frames, done));
  const std::string eta =
      done > 0 ? duration_text(left * seconds / static_cast<double>(done)) : std::string("?");
  fmt::print(stderr, "{}{} {}/{}  frames {}/{}  ETA {}{}", on_terminal() ? "\r" : "", label_,
             jobs_done_, frames_done_.size(), done, all_frames, eta, end);
}

}  // namespace baton
