// Runs a fuzz target without libFuzzer: on every file of its corpus, and on changed ones that
// follow from a seed. The same inputs on every machine. usage: fuzz_TARGET CHANGED CORPUS [FILE...]
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <vector>

#include "common/base/files.h"
#include "tests/fuzz/fuzz_target.h"

namespace baton {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCulprit = "fuzz-input";
constexpr std::size_t kMaxInputBytes = 1 << 16;

Bytes g_input;  ///< what the target is looking at

/// Keeps the input that ends the process.
void keep_input(int signal) {
  const int file = ::open(kCulprit, O_WRONLY | O_CREAT | O_TRUNC, 0644);
  const bool kept = file >= 0 && ::write(file, g_input.data(), g_input.size()) >= 0;
  constexpr std::string_view kText = "the input is in ./fuzz-input\n";
  if (kept && ::write(STDERR_FILENO, kText.data(), kText.size()) < 0) ::_exit(1);
  ::raise(signal);
}

void look_at(Bytes input) {
  g_input = std::move(input);
  // A copy of exactly its size, so that a sanitizer sees what reads past it.
  const Bytes exact(g_input.begin(), g_input.end());
  LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(exact.data()), exact.size());
}

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t end) { return end == 0 ? 0 : random() % end; }

/// One change of the kinds that libFuzzer makes, too.
void change(Bytes& input, const Bytes& other, Random& random) {
  constexpr std::array<std::uint64_t, 8> kNumbers{0,      1,          0x7f,       0xff,
                                                  0xffff, 0x7fffffff, 0xffffffff, ~0ull};
  const auto at = static_cast<std::ptrdiff_t>(below(random, input.size()));
  const auto room = input.size() - static_cast<std::size_t>(at);
  const auto count = static_cast<std::ptrdiff_t>(std::min(room, 1 + below(random, 16)));
  switch (below(random, 6)) {
    case 0:  // another bit
      if (room > 0) input[static_cast<std::size_t>(at)] ^= std::byte{1} << below(random, 8);
      break;
    case 1:  // another byte
      if (room > 0) input[static_cast<std::size_t>(at)] = static_cast<std::byte>(random());
      break;
    case 2: {  // a number at a limit
      const std::uint64_t number = kNumbers[below(random, kNumbers.size())];
      const std::size_t size = std::min<std::size_t>(room, std::size_t{1} << below(random, 4));
      if (size > 0) std::memcpy(&input[static_cast<std::size_t>(at)], &number, size);
      break;
    }
    case 3:  // something missing
      input.erase(input.begin() + at, input.begin() + at + count);
      break;
    case 4: {  // something twice
      const Bytes part(input.begin() + at, input.begin() + at + count);
      input.insert(input.begin() + at, part.begin(), part.end());
      break;
    }
    default: {  // the rest of another one
      const auto from = std::min(static_cast<std::size_t>(at), other.size());
      input.resize(static_cast<std::size_t>(at));
      input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(from), other.end());
    }
  }
}

Status run(int num_changed, const fs::path& corpus, std::vector<fs::path> paths) {
  for (const auto& entry : fs::directory_iterator(corpus)) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<Bytes> files;
  for (const fs::path& path : paths) {
    BATON_ASSIGN(Bytes bytes, read_file(path, kMaxInputBytes));
    files.push_back(std::move(bytes));
    look_at(files.back());
  }

  Random random(1);
  for (int i = 0; i < num_changed; ++i) {
    Bytes input = files[below(random, files.size())];
    const Bytes& other = files[below(random, files.size())];
    for (std::size_t changes = 1 + below(random, 4); changes > 0; --changes)
      change(input, other, random);
    input.resize(std::min(input.size(), kMaxInputBytes));
    look_at(std::move(input));
  }
  fmt::print("{} files, {} changed ones\n", files.size(), num_changed);
  return {};
}

}  // namespace
}  // namespace baton

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(stderr, "usage: {} CHANGED CORPUS [FILE...]\n", argv[0]);
    return 64;
  }
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGBUS}) {
    // A sanitizer has handlers of its own, which say more.
    struct sigaction action {};
    ::sigaction(signal, nullptr, &action);
    if (action.sa_handler != SIG_DFL) continue;
    action.sa_handler = baton::keep_input;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    ::sigaction(signal, &action, nullptr);
  }
  const baton::Status status = baton::run(
      std::atoi(argv[1]), argv[2], std::vector<std::filesystem::path>(argv + 3, argv + argc));
  if (status) return 0;
  fmt::print(stderr, "{}\n", status.error().message);
  return 1;
}
