// SPDX-License-Identifier: MIT
#include "lecalib/host/error.hpp"

namespace lecalib::host {

std::string to_string(const Error& error) {
  std::string text = error.file;
  if (error.line > 0) {
    text += ":" + std::to_string(error.line);
    if (error.column > 0) text += ":" + std::to_string(error.column);
  }
  if (error.byte) text += (text.empty() ? "byte " : ": byte ") + std::to_string(*error.byte);
  if (!text.empty()) text += ": ";
  return text + error.message;
}

}  // namespace lecalib::host
