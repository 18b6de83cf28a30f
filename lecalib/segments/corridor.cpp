// SPDX-License-Identifier: MIT
#include "lecalib/segments/corridor.hpp"

namespace lecalib::detail {
namespace {

constexpr std::uint32_t kBits[kNearBlock] = {1U << 0,  1U << 1,  1U << 2,  1U << 3, 1U << 4,  1U << 5,
                                             1U << 6,  1U << 7,  1U << 8,  1U << 9, 1U << 10, 1U << 11,
                                             1U << 12, 1U << 13, 1U << 14, 1U << 15};

}  // namespace

std::uint32_t NearBlock::find(const EventCloud& cloud, std::uint32_t first, std::uint32_t stride,
                              std::size_t count) noexcept {
  const std::uint16_t* x = cloud.x.data() + first;
  const std::uint16_t* y = cloud.y.data() + first;
  const std::uint16_t* t = cloud.t.data() + first;
  if (stride > 1 || first + kNearBlock > cloud.size()) {
    for (std::size_t k = 0; k < count; ++k) {
      x_[k] = x[stride * k];
      y_[k] = y[stride * k];
      t_[k] = t[stride * k];
    }
    x = x_, y = y_, t = t_;
  }
  std::uint32_t near = 0;
  for (std::size_t k = 0; k < kNearBlock; ++k) {
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
    near |= is_near ? kBits[k] : 0;
  }
  return near & ((1U << count) - 1);
}

}  // namespace lecalib::detail
