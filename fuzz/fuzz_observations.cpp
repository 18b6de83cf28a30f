// SPDX-License-Identifier: MIT
// Lists of observations: any text is either a sound list or an error of one line with its place.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "lecalib/host/observation_file.hpp"

namespace {

using namespace lecalib;

void require(bool sound) {
  if (!sound) __builtin_trap();
}

void check(const host::Observations& observations, const host::Model& model) {
  require(!observations.views.empty());
  require(observations.views.size() == observations.view_names.size());
  std::size_t next = 0;
  for (const View& view : observations.views) {
    require(view.first == next && view.count >= 2);
    next += view.count;
  }
  require(next == observations.points.size());
  for (const LinePoint& point : observations.points) {
    require(point.line < model.lines.size());
    require(std::isfinite(point.u_px) && std::isfinite(point.v_px) && std::isfinite(point.sigma_px));
    require(point.sigma_px > 0);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const host::Model model = host::make_target("rectangle:2x1").value();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto observations = host::parse_observations(text, "observations.csv", model, {640, 480});
  if (observations.ok()) {
    check(observations.value(), model);
  } else {
    require(!observations.error().message.empty());
    require(to_string(observations.error()).find('\n') == std::string::npos);
  }
  return 0;
}
