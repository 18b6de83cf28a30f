// SPDX-License-Identifier: MIT
// Model files and target descriptions: any text is either a sound model or an error of one line with its place.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "lecalib/host/model_file.hpp"

namespace {

using namespace lecalib;

void require(bool sound) {
  if (!sound) __builtin_trap();
}

void check(const host::Result<host::Model>& model) {
  if (!model.ok()) {
    require(!model.error().message.empty());
    require(to_string(model.error()).find('\n') == std::string::npos);
    return;
  }
  require(model.value().lines.size() >= host::kMinModelLines);
  require(model.value().lines.size() == model.value().names.size());
  for (const ModelLine& line : model.value().lines) {
    bool different = false;
    for (int k = 0; k < 3; ++k) {
      require(std::isfinite(line.p[k]) && std::isfinite(line.q[k]));
      different = different || line.p[k] != line.q[k];
    }
    require(different);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check(host::parse_model(text, "model.txt"));
  if (text.substr(0, 5) != "file:") check(host::make_target(text));
  return 0;
}
