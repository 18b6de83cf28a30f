// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/line_bank.hpp"

namespace lecalib {
float LineBank::information_of(Span<const EventLine> lines) {
  constexpr float kWithoutEdge = 1;  // what lines tell that have no edge is next to nothing, but not nothing
  float sum = kWithoutEdge;
  for (const EventLine& line : lines) {
    sum += kWithoutEdge;
    if (line.edge.crossings == 0) continue;
    for (const float sigma_px : line.edge.sigma_px) sum += 1 / (sigma_px * sigma_px);
  }
  return sum;
}

void LineBank::clear() {
  count_ = 0;
  offered_ = 0;
  lines_dropped_ = 0;
}

void LineBank::add(const LineWindow& window, float information) {
  const std::uint32_t offer = offered_++;
  if (windows_.empty()) return;
  std::uint32_t free_place = count_;
  if (count_ == windows_.size()) {
    const std::size_t out = least_missed();
    free_place = kept_[out].place;
    take_out(out);
  }
  const Span<EventLine> place = lines_.subspan(std::size_t{free_place} * lines_per_window_, lines_per_window_);
  const Span<const EventLine> lines = window.lines.first(place.size());
  lines_dropped_ += static_cast<std::uint32_t>(window.lines.size() - lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) place[i] = lines[i];
  windows_[count_] = {window.begin_us, window.end_us, {place.data(), lines.size()}};
  kept_[count_++] = {offer, free_place, information};
}

/// The first window stays: nothing before it stands for it.
std::size_t LineBank::least_missed() const {
  std::size_t least = 0;
  float least_missed = 0;
  for (std::size_t i = 1; i < count_; ++i) {
    const std::uint32_t next = i + 1 < count_ ? kept_[i + 1].offer : offered_ - 1;
    const float missed = static_cast<float>(next - kept_[i - 1].offer) * kept_[i].information;
    if (least != 0 && missed >= least_missed) continue;
    least = i;
    least_missed = missed;
  }
  return least;
}

void LineBank::take_out(std::size_t index) {
  --count_;
  for (std::size_t i = index; i < count_; ++i) {
    windows_[i] = windows_[i + 1];
    kept_[i] = kept_[i + 1];
  }
}

}  // namespace lecalib
