// SPDX-License-Identifier: MIT
#include "lecalib/segments/corridor.hpp"

namespace lecalib::detail {

std::uint32_t NearBlock::find(const EventCloud& cloud, std::uint32_t first, std::uint32_t stride,
                              std::size_t count) noexcept {
  const std::uint16_t* x = cloud.x.data() + first;
  const std::uint16_t* y = cloud.y.data() + first;
  const std::uint16_t* t = cloud.t.data() + first;
  if (stride > 1 || first + kEventBlock > cloud.size()) {
    for (std::size_t k = 0; k < count; ++k) {
      x_[k] = x[stride * k];
      y_[k] = y[stride * k];
      t_[k] = t[stride * k];
    }
    x = x_, y = y_, t = t_;
  }
  std::uint32_t near = 0;
  for (std::size_t k = 0; k < kEventBlock; ++k) {
    const float tau = EventCloud::tau_of(t[k]);
    const float s = along(x[k], y[k]);
    const float d = across(x[k], y[k]);
    const float r = residual(s, d, tau);
    along_[k] = s;
    across_[k] = d;
    tau_[k] = tau;
    residual_[k] = r;
    const bool is_near = static_cast<unsigned>(s >= s0_) & static_cast<unsigned>(s < s1_) &
                         static_cast<unsigned>(std::fabs(r) <= band_px_);
    near |= is_near ? kEventBits[k] : 0;
  }
  return near & ((1U << count) - 1);
}

}  // namespace lecalib::detail
