// SPDX-License-Identifier: MIT
#include "lecalib/pipeline/line_bank.hpp"

namespace lecalib {

void LineBank::clear() {
  count_ = 0;
  stride_ = 1;
  offered_ = 0;
  lines_dropped_ = 0;
}

void LineBank::add(const LineWindow& window) {
  const std::uint32_t index = offered_++;
  if (index % stride_ != 0 || windows_.empty()) return;
  if (count_ == windows_.size()) {
    keep_every_other();
    if (index % stride_ != 0 || count_ == windows_.size()) return;
  }
  const std::size_t excess = window.lines.size() - window.lines.first(lines_per_window_).size();
  lines_dropped_ += static_cast<std::uint32_t>(excess);
  store(count_++, window);
}

void LineBank::keep_every_other() {
  stride_ *= 2;
  for (std::uint32_t kept = 1; 2 * kept < count_; ++kept) store(kept, windows_[std::size_t{2} * kept]);
  count_ = (count_ + 1) / 2;
}

void LineBank::store(std::uint32_t slot, const LineWindow& window) {
  const Span<EventLine> place = lines_.subspan(std::size_t{slot} * lines_per_window_, lines_per_window_);
  const Span<const EventLine> lines = window.lines.first(place.size());
  for (std::size_t i = 0; i < lines.size(); ++i) place[i] = lines[i];
  windows_[slot] = {window.begin_us, window.end_us, {place.data(), lines.size()}};
}

}  // namespace lecalib
