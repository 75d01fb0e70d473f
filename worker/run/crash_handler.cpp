#include "worker/run/crash_handler.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>

namespace baton {
namespace {

enum SlotState : int { kFree, kWriting, kReady };

struct Slot {
  std::atomic<int> state{kFree};
  std::size_t size = 0;
  std::array<char, 501> text{};
};

/// A signal handler can reach only what is global; it reads slots that are ready and never locks.
std::array<Slot, 256> g_slots;

void print(const char* text, std::size_t size) {
  [[maybe_unused]] const ssize_t ignored = ::write(STDERR_FILENO, text, size);
}

void on_crash(int signal_number) {
  constexpr std::string_view kIntro = "baton-worker: crashed while doing:\n";
  print(kIntro.data(), kIntro.size());
  for (const Slot& slot : g_slots) {
    if (slot.state.load(std::memory_order_acquire) == kReady) print(slot.text.data(), slot.size);
  }
  // SA_RESETHAND has put the default action back: die of the same signal.
  ::raise(signal_number);
}

}  // namespace

void install_crash_handler() {
  struct sigaction action {};
  action.sa_handler = on_crash;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int signal_number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    ::sigaction(signal_number, &action, nullptr);
  }
}

CrashNote::CrashNote(std::string_view text) {
  // Claim a slot, fill it, then show it to the handler.
  for (std::size_t i = 0; i < g_slots.size() && slot_ < 0; ++i) {
    int expected = kFree;
    if (g_slots[i].state.compare_exchange_strong(expected, kWriting)) slot_ = static_cast<int>(i);
  }
  if (slot_ < 0) return;
  Slot& slot = g_slots[static_cast<std::size_t>(slot_)];
  slot.size = std::min(text.size(), slot.text.size() - 1);
  std::copy_n(text.begin(), slot.size, slot.text.begin());
  slot.text[slot.size++] = '\n';
  slot.state.store(kReady, std::memory_order_release);
}

CrashNote::~CrashNote() {
  if (slot_ >= 0) g_slots[static_cast<std::size_t>(slot_)].state.store(kFree);
}

}  // namespace baton
