#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "common/base/result.h"

namespace baton {

/// main of a benchmark that starts the programs beside it: [JOB.json] [COUNT]. `run` gets their
/// folder, the job and the count, `count` where none is given. Returns the exit code.
template <class Run>
int bench_program(int argc, char** argv, int count, const Run& run) {
  const auto bin = std::filesystem::canonical("/proc/self/exe").parent_path();
  const std::string job = argc > 1 ? argv[1] : "jobs/examples/demo.json";
  const Status status = run(bin, job, argc > 2 ? std::max(1, std::atoi(argv[2])) : count);
  if (status) return 0;
  fmt::print(stderr, "{}\n", status.error().message);
  return 70;
}

}  // namespace baton
