// SPDX-License-Identifier: MIT
#include "lecalib/host/svg_text.hpp"

namespace lecalib::host {

std::string svg_text(std::string_view plain) {
  std::string out;
  for (const char c : plain) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

}  // namespace lecalib::host
