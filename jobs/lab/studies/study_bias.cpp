// The bias of every method with 1 to 64 sites, at rest and in motion, as fine as time allows: what
// tests/stat/rounds_test.cpp asks with fewer seeds and rounds. With the numbers that are the
// default, 200 seeds of 64 rounds, a bias of 0.04 to 0.3 % would show; an hour.
// Usage: study_bias [SEEDS [ROUNDS]]
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "tests/stat/sites_study.h"

int main(int argc, char** argv) {
  using namespace baton;
  const test::StudySize size{argc > 1 ? std::max(2, std::atoi(argv[1])) : 200,
                             argc > 2 ? std::max(1, std::atoi(argv[2])) : 64};
  bool all_agree = true;
  for (const bool in_motion : {false, true}) {
    fmt::print("{}: bias, its standard error, |z| of picture and worst pixel\n",
               in_motion ? "in motion" : "at rest");
    test::study_sites(in_motion, size, [&](const test::StudyRow& row) {
      const test::Verdict& v = row.verdict;
      fmt::print("{:<14} {:2} sites {:+.3f} % ({:.3f}) {:.2f} {:.2f}\n", traits(row.method).name,
                 row.sites, 100 * row.bias, 100 * v.resolution / test::kResolvedErrors, v.image,
                 v.worst_pixel);
      std::fflush(stdout);
      all_agree = all_agree && v.image < test::kImageLimit && v.worst_pixel < test::kPixelLimit;
    });
  }
  return all_agree ? 0 : 1;
}
