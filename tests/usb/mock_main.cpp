// SPDX-License-Identifier: MIT
/// Runs the tests under umockdev-wrapper, which must be there before the program is; 77 without it.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace {

constexpr int kSkipped = 77;

bool is_wrapped() {
  const char* const preload = ::getenv("LD_PRELOAD");
  return preload != nullptr && std::strstr(preload, "umockdev") != nullptr;
}

int run_wrapped(int argc, char** argv) {
  // The preloaded library comes before that of the sanitizer, and GLib keeps some memory to its end.
  (void)::setenv("ASAN_OPTIONS", "verify_asan_link_order=0:detect_leaks=0", 1);
  std::vector<char*> words(argv, argv + argc);
  std::string wrapper = "umockdev-wrapper";
  words.insert(words.begin(), wrapper.data());
  words.push_back(nullptr);
  (void)::execvp(words[0], words.data());
  std::fputs("skipped: umockdev-wrapper is not there (Debian: umockdev), no camera can be played\n", stderr);
  return kSkipped;
}

}  // namespace

int main(int argc, char** argv) {
  const bool lists =
      std::any_of(argv, argv + argc, [](const char* word) { return std::strstr(word, "--list") != nullptr; });
  if (!is_wrapped() && !lists) return run_wrapped(argc, argv);
  (void)::setenv("ASAN_OPTIONS", "verify_asan_link_order=0", 1);  // for the program that is tested: it leaks nothing
  return doctest::Context(argc, argv).run();
}
