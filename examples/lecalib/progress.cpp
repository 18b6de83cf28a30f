// SPDX-License-Identifier: MIT
#include "progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

namespace lecalib::command {
namespace {

constexpr int kBarWidth = 40;  // characters
constexpr std::chrono::milliseconds kFirstAfter{500};
constexpr std::chrono::milliseconds kEvery{100};

}  // namespace

Progress::Progress(std::string what)
    : what_(std::move(what)), is_terminal_(::isatty(STDERR_FILENO) == 1), next_(Clock::now() + kFirstAfter) {}

Progress::~Progress() {
  if (is_drawn_) std::fputs("\r\x1b[K", stderr);
}

bool Progress::is_due() {
  if (!is_terminal_ || Clock::now() < next_) return false;
  next_ = Clock::now() + kEvery;
  is_drawn_ = true;
  return true;
}

void Progress::update(double fraction) {
  if (!is_due()) return;
  const double done = std::clamp(fraction, 0.0, 1.0);
  const auto full = static_cast<std::size_t>(done * kBarWidth);
  const std::string bar = std::string(full, '#') + std::string(kBarWidth - full, '.');
  std::fprintf(stderr, "\r%s [%s] %3d %%", what_.c_str(), bar.c_str(), static_cast<int>(done * 100));
}

void Progress::show(const std::string& text) {
  if (is_due()) std::fprintf(stderr, "\r%s %s\x1b[K", what_.c_str(), text.c_str());
}

}  // namespace lecalib::command
