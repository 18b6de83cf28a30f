// SPDX-License-Identifier: MIT
#include "house/source_files.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "support/shared_data.hpp"

namespace lecalib::test {
namespace {

std::vector<std::string> split_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

// Comments and the contents of string literals become blanks; line breaks stay. Raw strings are not known to it.
std::string blank_non_code(std::string text) {
  enum class In { code, line_comment, block_comment, string } state = In::code;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool slash_follows = text[i] == '/' && i + 1 < text.size();
    if (state == In::code) {
      if (slash_follows && text[i + 1] == '/') state = In::line_comment;
      if (slash_follows && text[i + 1] == '*') state = In::block_comment;
      if (text[i] == '"' && (i == 0 || text[i - 1] != '\'')) {
        state = In::string;
        continue;
      }
    } else if (state == In::line_comment) {
      if (text[i] == '\n') state = In::code;
    } else if (state == In::block_comment) {
      if (text[i] == '*' && i + 1 < text.size() && text[i + 1] == '/') {
        text[i++] = ' ';
        text[i] = ' ';
        state = In::code;
      }
    } else if (text[i] == '\\') {
      text[i++] = ' ';
    } else if (text[i] == '"') {
      state = In::code;
    }
    if (state != In::code && text[i] != '\n') text[i] = ' ';
  }
  return text;
}

}  // namespace

std::string SourceFile::room() const {
  auto part = path.begin();
  if (part == path.end() || *part++ != "lecalib" || part == path.end()) return {};
  return part->string();
}

SourceFile parse_source(const std::filesystem::path& path, const std::string& text) {
  return {path, split_lines(text), split_lines(blank_non_code(text))};
}

std::vector<SourceFile> source_files(const std::filesystem::path& folder) {
  std::vector<SourceFile> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(source_dir() / folder)) {
    const std::filesystem::path extension = entry.path().extension();
    if (extension != ".hpp" && extension != ".cpp") continue;
    std::ifstream stream(entry.path());
    if (!stream) throw std::runtime_error("cannot read " + entry.path().string());
    std::ostringstream text;
    text << stream.rdbuf();
    files.push_back(parse_source(std::filesystem::relative(entry.path(), source_dir()), text.str()));
  }
  std::sort(files.begin(), files.end(), [](const SourceFile& a, const SourceFile& b) { return a.path < b.path; });
  return files;
}

std::vector<Include> includes_of(const SourceFile& file) {
  std::vector<Include> includes;
  for (const std::string& line : file.lines) {
    if (line.rfind("#include ", 0) != 0) continue;
    const std::size_t open = line.find_first_of("<\"");
    const std::size_t close = line.find_first_of(">\"", open + 1);
    if (open == std::string::npos || close == std::string::npos) continue;
    includes.push_back({line.substr(open + 1, close - open - 1), line[open] == '"'});
  }
  return includes;
}

}  // namespace lecalib::test
