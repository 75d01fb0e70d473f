#pragma once

#include <cstdio>
#include <cstdlib>

namespace baton::detail {
[[noreturn]] inline void check_failed(const char* what, const char* file, int line) {
  std::fprintf(stderr, "baton: broken invariant at %s:%d: %s\n", file, line, what);
  std::abort();
}
}  // namespace baton::detail

/// A broken invariant stops the process with its location. Always on: it guards data, not speed.
#define BATON_CHECK(condition)        \
  ((condition) ? static_cast<void>(0) \
               : ::baton::detail::check_failed(#condition, __FILE__, __LINE__))

/// A BATON_CHECK in checked builds alone (BATON_CHECKED in cmake/baton.cmake): it guards what inner
/// loops do.
#ifdef BATON_CHECKED
#define BATON_DCHECK(condition) BATON_CHECK(condition)
#else
#define BATON_DCHECK(condition) static_cast<void>(0)
#endif
