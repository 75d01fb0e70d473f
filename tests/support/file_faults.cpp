// A library to be loaded before all others (LD_PRELOAD) that makes a disk bad for a program:
//   BATON_FILE_FAULTS=N:TEXT  one in N looks at or openings of files with TEXT in their path fails
//                             with EIO or ESTALE; numbers of a fixed sequence decide which
//   BATON_FILES_LATE=MS:TEXT  files with TEXT in their path are not seen for so long after they
//                             appeared under their name, as on another machine
// (test_bad_disk.py). Files that are opened to be written are left alone.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/stat.h>
#include <time.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace {

template <class F>
F original(const char* name) {
  return reinterpret_cast<F>(::dlsym(RTLD_NEXT, name));
}

/// "NUMBER:TEXT" of a variable.
struct Wish {
  long number = 0;
  const char* text = nullptr;

  explicit Wish(const char* variable) {
    const char* const value = std::getenv(variable);
    if (value == nullptr) return;
    char* end = nullptr;
    number = std::strtol(value, &end, 10);
    if (*end == ':') text = end + 1;
  }
  bool is_for(const char* path) const {
    return number > 0 && text != nullptr && path != nullptr && std::strstr(path, text) != nullptr;
  }
};

using Stat = int (*)(const char*, struct stat*);

/// The error that a call about this path gets; 0: none.
int fault_of(const char* path) {
  static const Wish faults("BATON_FILE_FAULTS"), late("BATON_FILES_LATE");
  static std::atomic<std::uint64_t> count{0};
  if (faults.is_for(path)) {
    // SplitMix64.
    std::uint64_t x = 0x9e3779b97f4a7c15u * ++count;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    if (x % static_cast<std::uint64_t>(faults.number) == 0) return (x >> 40) % 2 ? EIO : ESTALE;
  }
  if (late.is_for(path)) {
    static const auto look = original<Stat>("stat");
    struct stat status {};
    timespec now{};
    // A rename changes the time of the status.
    if (look(path, &status) == 0 && ::clock_gettime(CLOCK_REALTIME, &now) == 0) {
      const long age_ms = (now.tv_sec - status.st_ctim.tv_sec) * 1000 +
                          (now.tv_nsec - status.st_ctim.tv_nsec) / 1'000'000;
      if (age_ms < late.number) return ENOENT;
    }
  }
  return 0;
}

bool fails(const char* path) {
  const int fault = fault_of(path);
  if (fault != 0) errno = fault;
  return fault != 0;
}

}  // namespace

extern "C" int stat(const char* path, struct stat* status) noexcept {
  static const auto call = original<Stat>("stat");
  return fails(path) ? -1 : call(path, status);
}

extern "C" int stat64(const char* path, struct stat64* status) noexcept {
  static const auto call = original<int (*)(const char*, struct stat64*)>("stat64");
  return fails(path) ? -1 : call(path, status);
}

extern "C" int open(const char* path, int flags, ...) {
  static const auto call = original<int (*)(const char*, int, mode_t)>("open");
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return (flags & O_ACCMODE) == O_RDONLY && fails(path) ? -1 : call(path, flags, mode);
}

extern "C" int open64(const char* path, int flags, ...) {
  static const auto call = original<int (*)(const char*, int, mode_t)>("open64");
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  return (flags & O_ACCMODE) == O_RDONLY && fails(path) ? -1 : call(path, flags, mode);
}

extern "C" FILE* fopen(const char* path, const char* mode) {
  static const auto call = original<FILE* (*)(const char*, const char*)>("fopen");
  return mode[0] == 'r' && fails(path) ? nullptr : call(path, mode);
}

extern "C" FILE* fopen64(const char* path, const char* mode) {
  static const auto call = original<FILE* (*)(const char*, const char*)>("fopen64");
  return mode[0] == 'r' && fails(path) ? nullptr : call(path, mode);
}
