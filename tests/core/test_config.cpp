// SPDX-License-Identifier: MIT
#define LECALIB_CHECK 1  // the macro itself is under test, in release builds too
#include <doctest/doctest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csetjmp>
#include <initializer_list>
#include <string>

#include "lecalib/core/config.hpp"

namespace {

std::jmp_buf g_after_assert;
const char* g_expression = nullptr;
const char* g_file = nullptr;
int g_line = 0;

// A handler must not return. Only plain frames lie between the assert and the test, so a jump may skip them.
void jump_out(const char* expression, const char* file, int line) {
  g_expression = expression;
  g_file = file;
  g_line = line;
  std::longjmp(g_after_assert, 1);
}

}  // namespace

TEST_CASE("assert: a failed one hands its text and place to the handler") {
  lecalib::set_assert_handler(jump_out);
  volatile int one = 1;
  bool jumped = false;
  if (setjmp(g_after_assert) == 0) {
    LECALIB_ASSERT(one == 2);
  } else {
    jumped = true;
  }
  lecalib::set_assert_handler(nullptr);
  REQUIRE(jumped);
  CHECK(std::string(g_expression) == "one == 2");
  CHECK(std::string(g_file).find("test_config.cpp") != std::string::npos);
  CHECK(g_line > 0);
}

TEST_CASE("assert: one that holds is an expression and evaluates its condition once") {
  int evaluated = 0;
  const int value = (LECALIB_ASSERT(++evaluated == 1), 7);
  CHECK(value == 7);
  CHECK(evaluated == 1);
}

TEST_CASE("assert: without a handler, or with one that returns, the program stops") {
  for (const bool returning_handler : {false, true}) {
    CAPTURE(returning_handler);
    const pid_t child = fork();
    REQUIRE(child >= 0);
    if (child == 0) {
      close(STDERR_FILENO);  // the sanitizers' report of the wanted crash
      lecalib::set_assert_handler(returning_handler ? +[](const char*, const char*, int) {} : nullptr);
      volatile int one = 1;
      LECALIB_ASSERT(one == 2);
      _exit(0);
    }
    int how = 0;
    REQUIRE(waitpid(child, &how, 0) == child);
    CHECK_FALSE((WIFEXITED(how) && WEXITSTATUS(how) == 0));
  }
}
