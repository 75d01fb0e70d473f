#include "jobs/trace/trace_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

namespace baton {
namespace {

using Thread = std::pair<std::int32_t, std::int32_t>;
using Sums = std::map<std::string, double>;

std::vector<std::pair<std::string, double>> ordered(const Sums& sums) {
  std::vector<std::pair<std::string, double>> result(sums.begin(), sums.end());
  std::ranges::stable_sort(result, std::greater<>(), [](const auto& sum) { return sum.second; });
  return result;
}

std::string text_of(const std::vector<std::pair<std::string, double>>& sums) {
  std::string text;
  constexpr std::size_t kMost = 8;
  for (std::size_t i = 0; i < std::min(sums.size(), kMost); ++i)
    text += fmt::format("{}{} {:.2f}", i == 0 ? "" : ", ", sums[i].first, sums[i].second);
  return text.empty() ? "nothing" : text;
}

nlohmann::ordered_json json_of(const std::vector<std::pair<std::string, double>>& sums) {
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  for (const auto& [name, seconds] : sums) object[name] = seconds;
  return object;
}

}  // namespace

TraceSummary summarize(const Trace& trace, const std::vector<std::size_t>& threads) {
  TraceSummary summary;
  summary.seconds = trace.end_s() - trace.begin_s();
  std::set<Thread> seen;
  std::set<std::int32_t> workers;
  Sums done, waited;
  double busy_s = 0;
  struct Open {
    double task_end_s = 0, part_end_s = 0;
    std::string waits_for;  ///< empty: the part is no wait
  };
  std::map<Thread, Open> open;
  for (const TracedSpan& span : trace.spans) {
    const Thread thread(span.process, span.thread);
    const double from_s = span.start_s - trace.begin_s(), to_s = from_s + span.seconds;
    Open& now = open[thread];
    if (span.kind == SpanKind::task) {
      seen.insert(thread);
      workers.insert(span.process);
      now = {span.end_s(), 0, {}};
      busy_s += span.seconds;
      const std::string kind = span.task.kind.empty() ? without_number(span.name) : span.task.kind;
      done[kind] += span.seconds;
      summary.busy_over_time.add(summary.seconds, from_s, to_s);
      continue;
    }
    if (span.kind == SpanKind::help && span.start_s >= now.task_end_s) {
      seen.insert(thread);
      done["helping with " + without_number(span.name)] += span.seconds;
      busy_s += span.seconds;
      summary.busy_over_time.add(summary.seconds, from_s, to_s);
      continue;
    }
    // Works and waits that lie in no other; who helps meanwhile does not wait.
    if (span.kind == SpanKind::help && span.end_s() <= now.part_end_s && !now.waits_for.empty()) {
      waited[now.waits_for] -= span.seconds;
      done["helping with " + without_number(span.name)] += span.seconds;
      busy_s += span.seconds;
      summary.busy_over_time.add(summary.seconds, from_s, to_s);
      continue;
    }
    const bool counts = span.kind == SpanKind::make || span.kind == SpanKind::wait;
    if (!counts || span.end_s() > now.task_end_s || span.start_s < now.part_end_s) continue;
    now.part_end_s = span.end_s();
    now.waits_for = span.kind == SpanKind::wait ? without_number(span.name) : std::string();
    if (span.kind == SpanKind::make) {
      done["making " + without_number(span.name)] += span.seconds;
    } else {
      waited[without_number(span.name)] += span.seconds;
      busy_s -= span.seconds;
      summary.busy_over_time.add(summary.seconds, from_s, to_s, -1);
    }
  }
  summary.threads = seen.size();
  summary.workers = workers.size();
  summary.busy = summary.seconds > 0 ? busy_s / summary.seconds : 0;
  const double idle_s = summary.seconds * static_cast<double>(seen.size()) - busy_s;
  double waited_s = 0;
  for (const auto& [what, seconds] : waited) waited_s += seconds;
  waited["a task"] = std::max(idle_s - waited_s, 0.0);
  summary.done = ordered(done);
  summary.waited = ordered(waited);

  const PlayedTrace apart = take_apart(trace);
  summary.lead_s = apart.lead_s;
  summary.tail_s = apart.tail_s;
  for (const std::size_t count : threads) summary.played.emplace_back(count, play(apart, count));
  constexpr std::size_t kNoLimit = 1u << 20;  // tasks and parts at a time
  summary.without_limit = play(apart, kNoLimit);
  return summary;
}

std::string summary_text(const TraceSummary& summary) {
  std::string text = fmt::format(
      "time       {:.2f} s, {} threads of {} workers, {:.1f} of them busy\n"
      "no task    {:.2f} s before the first, {:.2f} s after the last\n"
      "busy       ",
      summary.seconds, summary.threads, summary.workers, summary.busy, summary.lead_s,
      summary.tail_s);
  const auto add_busy = [&](const BusyOverTime& busy) {
    for (const double threads : busy.threads) text += fmt::format("{:.0f} ", threads);
  };
  add_busy(summary.busy_over_time);
  text += fmt::format("\nthreads did      s: {}\nthey waited for  s: {}\n", text_of(summary.done),
                      text_of(summary.waited));
  const Playback& chain = summary.without_limit;
  const std::vector<std::pair<std::string, double>> waits(chain.chain_waits_s.begin(),
                                                          chain.chain_waits_s.end());
  const std::vector<std::pair<std::string, double>> links(chain.chain_s.begin(),
                                                          chain.chain_s.end());
  text += fmt::format("chain      {:.2f} s, the longest: {} tasks: s: {}; it waits for s: {}\n",
                      chain.seconds, chain.chain_tasks, text_of(links), text_of(waits));
  for (const auto& [threads, played] : summary.played) {
    text +=
        fmt::format("played     {:3} threads: {:.2f} s, {:.1f} busy ({:.0f} %)\n", threads,
                    played.seconds, played.busy, 100 * played.busy / static_cast<double>(threads));
    text += "           ";
    add_busy(played.busy_over_time);
    text += '\n';
  }
  return text;
}

nlohmann::ordered_json summary_json(const TraceSummary& summary) {
  nlohmann::ordered_json told{{"seconds", summary.seconds},
                              {"threads", summary.threads},
                              {"workers", summary.workers},
                              {"busy", summary.busy},
                              {"leadSeconds", summary.lead_s},
                              {"tailSeconds", summary.tail_s},
                              {"busyOverTime", summary.busy_over_time.threads},
                              {"doneSeconds", json_of(summary.done)},
                              {"waitedSeconds", json_of(summary.waited)}};
  const Playback& chain = summary.without_limit;
  told["longestChain"] = {{"seconds", chain.seconds},
                          {"tasks", chain.chain_tasks},
                          {"doneSeconds", chain.chain_s},
                          {"waitedSeconds", chain.chain_waits_s}};
  told["played"] = nlohmann::ordered_json::array();
  for (const auto& [threads, played] : summary.played)
    told["played"].push_back({{"threads", threads},
                              {"seconds", played.seconds},
                              {"busy", played.busy},
                              {"busyOverTime", played.busy_over_time.threads}});
  return told;
}

}  // namespace baton
