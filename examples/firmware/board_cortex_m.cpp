// SPDX-License-Identifier: MIT
// Start-up of a Cortex-M without an operating system: vectors, memory, FPU, stack. Prints by semihosting, which QEMU
// and debug probes understand; a product puts its UART there.
#include <cstddef>
#include <cstdint>

#include "board.hpp"

// From the linker script.
extern "C" {
extern std::uint32_t data_load[], data_begin[], data_end[], bss_begin[], bss_end[], stack_top[];
extern void (*init_array_begin[])();
extern void (*init_array_end[])();
}

// Under another name, since C++ forbids to call main; the program's main() in the object file.
extern "C" int program() __asm__("main");

namespace {

constexpr std::uint32_t kPaint = 0xDEADBEEF;

// Operations of semihosting.
constexpr int kWrite0 = 0x04;
constexpr int kExitExtended = 0x20;

int semihosting(int operation, const void* argument) {
  register int r0 __asm__("r0") = operation;
  register const void* r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

[[noreturn]] void stop(int code) {
  constexpr std::uint32_t kApplicationExit = 0x20026;
  const std::uint32_t reason_and_code[2] = {kApplicationExit, static_cast<std::uint32_t>(code)};
  semihosting(kExitExtended, reason_and_code);
  for (;;) {
  }
}

[[noreturn]] void on_fault() {
  board::print("fault\n");
  stop(99);
}

[[noreturn]] void on_reset() {
  const std::uint32_t* from = data_load;
  for (std::uint32_t* to = data_begin; to != data_end; ++to) *to = *from++;
  for (std::uint32_t* word = bss_begin; word != bss_end; ++word) *word = 0;

  // Access to the FPU (coprocessors 10 and 11).
  volatile std::uint32_t& cpacr = *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88);
  cpacr = cpacr | (0xFU << 20);
  __asm__ volatile("dsb\n isb" ::: "memory");

  std::uint32_t* sp = nullptr;
  __asm__ volatile("mov %0, sp" : "=r"(sp));
  constexpr std::ptrdiff_t kOwnFrame = 16;
  for (volatile std::uint32_t* word = bss_end; word < sp - kOwnFrame; ++word) *word = kPaint;

  for (auto function = init_array_begin; function != init_array_end; ++function) (*function)();
  stop(program());
}

using Vector = void (*)();
[[gnu::section(".vectors"), gnu::used]] const Vector vectors[16] = {
    reinterpret_cast<Vector>(stack_top), on_reset, on_fault, on_fault, on_fault, on_fault, on_fault, on_fault};

}  // namespace

namespace board {

void print(const char* text) { semihosting(kWrite0, text); }

std::size_t stack_used() {
  const std::uint32_t* word = bss_end;
  while (word != stack_top && *word == kPaint) ++word;
  return static_cast<std::size_t>(stack_top - word) * sizeof *word;
}

}  // namespace board
