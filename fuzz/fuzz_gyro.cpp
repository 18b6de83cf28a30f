// SPDX-License-Identifier: MIT
// Readings of a gyro: any text is either a sound list or an error of one line with its place.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "lecalib/host/gyro_file.hpp"

namespace {

using namespace lecalib;

void require(bool sound) {
  if (!sound) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto samples = host::parse_gyro(text, "gyro.csv");
  if (!samples.ok()) {
    require(!samples.error().message.empty());
    require(to_string(samples.error()).find('\n') == std::string::npos);
    return 0;
  }
  const auto& list = samples.value();
  require(!list.empty());
  for (std::size_t i = 1; i < list.size(); ++i) require(list[i].t_us > list[i - 1].t_us);
  if (list.size() < 2 || !(list.back().t_us - list.front().t_us < 1000000)) return 0;
  const View views[] = {{list.front().t_us, 0, 0}, {list.back().t_us, 0, 0}};
  for (const RelativePrior& turn : host::pair_views({}, list, views)) require(turn.sigma_rad > 0);
  return 0;
}
