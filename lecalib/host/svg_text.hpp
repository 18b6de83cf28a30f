// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace lecalib::host {

/// Plain text for the inside of an SVG element.
std::string svg_text(std::string_view plain);

}  // namespace lecalib::host
