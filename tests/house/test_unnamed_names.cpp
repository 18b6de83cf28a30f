// SPDX-License-Identifier: MIT
/// Files of a library may be compiled together, as one: what stands in unnamed namespaces needs names of its own.
#include <doctest/doctest.h>

#include <cctype>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "house/source_files.hpp"

namespace {

using lecalib::test::SourceFile;

bool is_name_character(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

/// The identifier at the end of the text, or nothing.
std::string last_name(std::string text) {
  while (!text.empty() && text.back() == ' ') text.pop_back();
  std::size_t begin = text.size();
  while (begin > 0 && is_name_character(text[begin - 1])) --begin;
  return text.substr(begin);
}

/// A list of parameters, "(const A& a, B b)", by their types: "(const A&,B)". Functions that differ in these may have
/// one name.
std::string types_of(const std::string& list) {
  std::string types, parameter;
  int depth = 0;
  for (const char c : list) {
    if (c == '(' || c == '<') ++depth;
    if (c == ')' || c == '>') --depth;
    if ((c == ',' && depth == 1) || depth == 0) {
      const std::string type = parameter.substr(0, parameter.find(" ="));
      const std::string name = last_name(type);
      const bool is_named = name.size() < type.size() && (type[type.size() - name.size() - 1] == ' ');
      types += type.substr(0, type.size() - (is_named ? name.size() + 1 : 0)) + c;
      parameter.clear();
      if (depth == 0) return types;
    } else if (c != ' ' || (!parameter.empty() && parameter.back() != ' ' && parameter.back() != '(')) {
      parameter += c;
    }
  }
  return types;
}

/// What a declaration at the begin of a line names: "kName", "Type", "function(types)"; nothing where it names nothing.
std::string declared_by(const std::string& text) {
  for (const char* other : {"template", "static_assert", "namespace", "extern", "using namespace", "#", "}", ")"}) {
    if (text.rfind(other, 0) == 0) return {};
  }
  if (text.rfind("using ", 0) == 0) {
    return text.find(" =") == std::string::npos ? std::string() : last_name(text.substr(0, text.find(" =")));
  }
  for (const char* kind : {"struct ", "class ", "union ", "enum "}) {
    if (text.rfind(kind, 0) == 0) return last_name(text.substr(0, text.find_first_of(":{;")));
  }
  int depth = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '<') ++depth;
    if (text[i] == '>') --depth;
    if (depth > 0) continue;
    if (text[i] == '(') {
      const std::string name = last_name(text.substr(0, i));
      const bool is_member = i > name.size() && text[i - name.size() - 1] == ':';
      return is_member ? std::string() : name + types_of(text.substr(i));
    }
    if (text[i] == '[' && i > 0 && text[i - 1] != ' ' && text[i - 1] != '[') return last_name(text.substr(0, i));
    if (text[i] == '=' || text[i] == '{' || text[i] == ';') return last_name(text.substr(0, i));
  }
  return {};
}

/// What stands in the file's unnamed namespaces.
std::vector<std::string> unnamed_names(const SourceFile& file) {
  std::vector<std::string> names;
  bool is_unnamed = false;
  for (std::size_t i = 0; i < file.code.size(); ++i) {
    if (file.lines[i] == "namespace {") is_unnamed = true;
    if (file.lines[i] == "}  // namespace") is_unnamed = false;
    if (!is_unnamed || file.code[i].empty() || file.code[i][0] == ' ') continue;
    std::string text = file.code[i];
    for (std::size_t next = i + 1; next < file.code.size() && text.find_first_of("{;=") == std::string::npos; ++next) {
      text += file.code[next];
    }
    const std::string name = declared_by(text);
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

/// The target that a file is compiled for.
std::string target_of(const SourceFile& file) {
  if (file.room() == "host" || file.room() == "usb") return file.room();
  return file.room().empty() ? "command" : "lecalib";
}

}  // namespace

TEST_CASE("house: files of a library share no name of an unnamed namespace") {
  std::map<std::string, std::string> where;  // by target and name
  for (const char* folder : {"lecalib", "examples/lecalib"}) {
    for (const SourceFile& file : lecalib::test::source_files(folder)) {
      for (const std::string& name : unnamed_names(file)) {
        const std::string path = file.path.string();
        const auto [first, is_new] = where.emplace(target_of(file) + " " + name, path);
        if (!is_new && first->second != path)
          FAIL_CHECK(path << ": " << name << " stands in " << first->second << " too");
      }
    }
  }
  CHECK(where.size() > 500);
}

TEST_CASE("house: names in unnamed namespaces are found") {
  const SourceFile file = lecalib::test::parse_source("lecalib/core/a.cpp",
                                                      "constexpr int kOutside = 1;\n"
                                                      "namespace {\n"
                                                      "using std::swap;\n"
                                                      "using Row = std::array<int, 2>;\n"
                                                      "constexpr std::array<Row, 2> kRows = {};\n"
                                                      "constexpr int kSizes[kCount] = {\n"
                                                      "    1, 2};\n"
                                                      "struct Part : Base {\n"
                                                      "  int a = 1;\n"
                                                      "};\n"
                                                      "template <class T>\n"
                                                      "T sum(Span<const T, 2> a, const Part& part,\n"
                                                      "      int n = 3) {\n"
                                                      "  return a;\n"
                                                      "}\n"
                                                      "Status Part::member() { return kOutside; }\n"
                                                      "std::size_t none() { return kOutside; }\n"
                                                      "}  // namespace\n"
                                                      "int named() { return 0; }\n");
  CHECK(unnamed_names(file) ==
        std::vector<std::string>{"Row", "kRows", "kSizes", "Part", "sum(Span<const T, 2>,const Part&,int)", "none()"});
}
