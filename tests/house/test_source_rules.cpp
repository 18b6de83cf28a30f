// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "house/source_files.hpp"

namespace {

using lecalib::test::SourceFile;

/// An identifier or keyword and what stands around it.
struct Word {
  std::string text;
  bool of_std;  ///< written std::text
  char next;    ///< the first character behind it that is no blank, or a blank
};

bool is_word_character(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

std::vector<Word> words_of(const std::string& line) {
  std::vector<Word> words;
  for (std::size_t begin = 0; begin < line.size();) {
    if (!is_word_character(line[begin])) {
      ++begin;
      continue;
    }
    std::size_t end = begin;
    while (end < line.size() && is_word_character(line[end])) ++end;
    const std::size_t next = line.find_first_not_of(' ', end);
    words.push_back({line.substr(begin, end - begin), begin >= 5 && line.compare(begin - 5, 5, "std::") == 0,
                     next == std::string::npos ? ' ' : line[next]});
    begin = end;
  }
  return words;
}

void check_absent(const SourceFile& file, const std::vector<std::string>& lines,
                  const std::function<bool(const Word&)>& unwanted) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (const Word& word : words_of(lines[i])) {
      if (unwanted(word)) FAIL_CHECK(file.path.string() << ":" << i + 1 << ": " << word.text);
    }
  }
}

void check_absent_on_microcontrollers(const std::function<bool(const Word&)>& unwanted) {
  for (const SourceFile& file : lecalib::test::source_files("lecalib")) {
    if (file.room() != "host" && file.room() != "usb") check_absent(file, file.code, unwanted);
  }
}

bool allocates_throws_or_prints(const Word& word) {
  static const std::set<std::string> from_std = {
      "any",      "deque",       "function",   "inplace_merge",    "list",   "map",           "set",    "shared_ptr",
      "string",   "stable_sort", "unique_ptr", "unordered_map",    "vector", "unordered_set", "thread", "mutex",
      "iostream", "cout",        "cerr",       "stable_partition", "sort"};  // recurses; std::sort_heap does not
  static const std::set<std::string> anywhere = {"alloca",  "calloc",   "catch", "dynamic_cast", "goto",
                                                 "malloc",  "printf",   "puts",  "throw",        "try",
                                                 "realloc", "snprintf", "typeid"};
  static const std::set<std::string> dynamic_eigen = {"MatrixXd", "MatrixXf", "VectorXd", "VectorXf",
                                                      "ArrayXd",  "ArrayXf",  "ArrayXXd", "ArrayXXf"};
  if (word.text == "new") return word.next != '(' && word.next != '>';  // in bytes that are there, and <new>, are fine
  if (word.text == "delete") return word.next != ';';                   // "= delete;" is fine
  if (word.text == "assert" || word.text == "free") return word.next == '(';
  return (word.of_std && from_std.count(word.text) == 1) || anywhere.count(word.text) == 1 ||
         dynamic_eigen.count(word.text) == 1;
}

// Of libm, only what IEEE 754 rounds exactly is the same everywhere.
bool differs_between_targets(const Word& word) {
  static const std::set<std::string> functions = {"acos", "asin", "atan",  "atan2", "cbrt",  "cos",   "cosh",
                                                  "exp",  "exp2", "expm1", "fma",   "hypot", "log",   "log10",
                                                  "log2", "pow",  "sin",   "sinh",  "tan",   "log1p", "tanh"};
  std::string name = word.text;
  if (functions.count(name) == 0 && name.size() > 1 && name.back() == 'f') name.pop_back();
  return word.next == '(' && functions.count(name) == 1;
}

}  // namespace

TEST_CASE("house: every source file states its licence first, keeps to 120 columns and leaves nothing unfinished") {
  // The words are put together here so that this file passes its own check.
  const std::set<std::string> unfinished = {std::string("TO") + "DO", std::string("FIX") + "ME",
                                            std::string("HA") + "CK", std::string("XX") + "X"};
  std::size_t checked = 0;
  for (const char* folder : {"lecalib", "examples", "tests", "fuzz"}) {
    for (const SourceFile& file : lecalib::test::source_files(folder)) {
      INFO(file.path.string());
      REQUIRE_FALSE(file.lines.empty());
      CHECK(file.lines.front() == "// SPDX-License-Identifier: MIT");
      if (file.path.extension() == ".hpp") {
        CHECK(std::count(file.lines.begin(), file.lines.end(), "#pragma once") == 1);
      }
      check_absent(file, file.lines, [&](const Word& word) { return unfinished.count(word.text) == 1; });
      // The formatter leaves comments and literals as they are, however long.
      for (std::size_t i = 0; i < file.lines.size(); ++i) {
        if (file.lines[i].size() > 120) FAIL_CHECK("line " << i + 1 << " is too long");
      }
      ++checked;
    }
  }
  CHECK(checked > 20);
}

TEST_CASE("house: nothing that allocates, throws or prints in what runs on a microcontroller") {
  check_absent_on_microcontrollers(allocates_throws_or_prints);
}

TEST_CASE("house: only arithmetic with the same bits on every target in what runs on a microcontroller") {
  check_absent_on_microcontrollers(differs_between_targets);
}

TEST_CASE("house: the source rules object to what they should") {
  const auto objects = [](const std::function<bool(const Word&)>& unwanted, const char* line) {
    const std::vector<Word> words = words_of(line);
    return std::any_of(words.begin(), words.end(), unwanted);
  };
  CHECK(objects(allocates_throws_or_prints, "std::vector<int> a;"));
  CHECK(objects(allocates_throws_or_prints, "int* a = new int;"));
  CHECK_FALSE(objects(allocates_throws_or_prints, "int* a = new (b) int;"));
  CHECK(objects(allocates_throws_or_prints, "delete a;"));
  CHECK(objects(allocates_throws_or_prints, "assert(a);"));
  CHECK_FALSE(objects(allocates_throws_or_prints, "A(const A&) = delete;"));
  CHECK_FALSE(objects(allocates_throws_or_prints, "static_assert(sizeof(a) == 4); Mat3 vectors; news"));
  CHECK(objects(differs_between_targets, "const double a = std::sin(b);"));
  CHECK(objects(differs_between_targets, "const float a = expf (b);"));
  CHECK_FALSE(objects(differs_between_targets, "const double a = std::sqrt(b) + exp_so3(c) + floor(log);"));
}

TEST_CASE("house: text in comments and literals is not taken for code") {
  const SourceFile file = lecalib::test::parse_source(
      "lecalib/core/a.cpp", "int a; // throw\n/* new\n int */ int b;\nconst char* c = \"malloc(\\\" \"; int d;\n");
  REQUIRE(file.code.size() == 4);
  CHECK(file.code[0].find("throw") == std::string::npos);
  CHECK(file.code[1].find("new") == std::string::npos);
  CHECK(file.code[2].find("int b;") != std::string::npos);
  CHECK(file.code[3].find("malloc") == std::string::npos);
  CHECK(file.code[3].find("int d;") != std::string::npos);
}
