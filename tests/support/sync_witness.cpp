// A library to be loaded before all others (LD_PRELOAD) that writes down, in the file
// $BATON_SYNC_RECORD and in the order in which they returned, what a program asks of the disk:
//   rename FROM TO BYTES MS      sync FILE BYTES      syncfs DEVICE      remove FILE
// MS: of the machine's monotonic clock, before the call.
// Programs rename files in folders that they hold open (write_file_atomic).
// From this a test tells what a power cut would have left (chaos.py), a benchmark what it waited
// for (bench_sizes.cpp). A folder has no bytes.
#include <dlfcn.h>
#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>

namespace {

/// A line at once, so that those of several processes keep their order.
template <class... Args>
void note(const char* format, Args... args) {
  static const char* const path = std::getenv("BATON_SYNC_RECORD");
  if (path == nullptr) return;
  std::array<char, 8300> line;
  const int length = std::snprintf(line.data(), line.size(), format, args...);
  const int file = ::open(path, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file < 0) return;
  if (::write(file, line.data(), static_cast<std::size_t>(length)) != length) std::abort();
  ::close(file);
}

template <class F>
F original(const char* name) {
  return reinterpret_cast<F>(::dlsym(RTLD_NEXT, name));
}

/// Of an open file or folder; empty: it has none.
std::array<char, 4096> path_of(int file) {
  std::array<char, 64> link;
  std::array<char, 4096> path{};
  std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", file);
  if (::readlink(link.data(), path.data(), path.size() - 1) < 0) path[0] = 0;
  return path;
}

long long num_bytes(const struct stat& status) {
  return S_ISREG(status.st_mode) ? static_cast<long long>(status.st_size) : 0;
}

/// rename(): does it.
template <class Rename>
int noted_rename(const Rename& rename, int from_folder, const char* from, int to_folder,
                 const char* to) {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  const long long ms = std::chrono::duration_cast<std::chrono::milliseconds>(since_start).count();
  const int result = rename();
  struct stat status {};
  if (result == 0 && ::fstatat(to_folder, to, &status, 0) == 0) {
    note("rename %s/%s %s/%s %lld %lld\n", path_of(from_folder).data(), from,
         path_of(to_folder).data(), to, num_bytes(status), ms);
  }
  return result;
}

}  // namespace

extern "C" int renameat(int from_folder, const char* from, int to_folder, const char* to) noexcept {
  using Call = int (*)(int, const char*, int, const char*);
  static const auto call = original<Call>("renameat");
  return noted_rename([&] { return call(from_folder, from, to_folder, to); }, from_folder, from,
                      to_folder, to);
}

extern "C" int renameat2(int from_folder, const char* from, int to_folder, const char* to,
                         unsigned int flags) noexcept {
  using Call = int (*)(int, const char*, int, const char*, unsigned int);
  static const auto call = original<Call>("renameat2");
  return noted_rename([&] { return call(from_folder, from, to_folder, to, flags); }, from_folder,
                      from, to_folder, to);
}

extern "C" int remove(const char* file) noexcept {
  static const auto call = original<int (*)(const char*)>("remove");
  const int result = call(file);
  if (result == 0) note("remove %s\n", file);
  return result;
}

extern "C" int fsync(int file) {
  static const auto call = original<int (*)(int)>("fsync");
  const int result = call(file);
  struct stat status {};
  if (result == 0 && ::fstat(file, &status) == 0)
    note("sync %s %lld\n", path_of(file).data(), num_bytes(status));
  return result;
}

extern "C" int syncfs(int file) noexcept {
  static const auto call = original<int (*)(int)>("syncfs");
  const int result = call(file);
  struct stat status {};
  if (result == 0 && ::fstat(file, &status) == 0)
    note("syncfs %llu\n", static_cast<unsigned long long>(status.st_dev));
  return result;
}
