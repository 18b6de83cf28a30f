// SPDX-License-Identifier: MIT
#include "interrupt.hpp"

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace lecalib::command {
namespace {

// Set by whichever thread the signal comes to.
std::atomic<int> came_flag{0};
static_assert(std::atomic<int>::is_always_lock_free, "a signal's handler may not wait");

void set_handler(void (*handler)(int), int flags) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = flags;
  for (const int signal : {SIGINT, SIGTERM}) (void)::sigaction(signal, &action, nullptr);
}

void on_signal(int /*signal*/) { came_flag = 1; }

}  // namespace

Interrupt::Interrupt() {
  came_flag = 0;
  set_handler(&on_signal, static_cast<int>(SA_RESETHAND | SA_RESTART));
}
Interrupt::~Interrupt() { set_handler(SIG_DFL, 0); }
bool Interrupt::came() { return came_flag != 0; }

}  // namespace lecalib::command
