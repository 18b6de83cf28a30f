// SPDX-License-Identifier: MIT
#include "lecalib/planes/cloud.hpp"

#include <algorithm>
#include <limits>

#include "lecalib/core/time.hpp"
#include "lecalib/math/poisson_floor.hpp"

namespace lecalib {
namespace {

/// Share of the cells that are taken for free of edges when the noise floor is measured.
constexpr float kQuietShare = 0.4F;
/// Counts above this are edges in any case, so the histogram can end there.
constexpr std::uint32_t kMaxQuietCount = 127;
/// Beyond it the differences of a window's times overflow.
constexpr std::uint64_t kLongestUs = std::numeric_limits<std::int64_t>::max();

/// Visits the events that lie on the sensor.
template <class Visit>
void for_each_inside(Span<const Event> events, const CloudOptions& options, Visit visit) {
  const std::uint16_t width = options.width;  // visit may write what could be the options
  const std::uint16_t height = options.height;
  for (const Event& event : events) {
    if (event.x < width && event.y < height) visit(event);
  }
}

/// Visits `keep` of the `total` events that lie on the sensor, evenly spread (Bresenham's rule).
template <class Visit>
void for_each_kept(Span<const Event> events, const CloudOptions& options, std::size_t total, std::size_t keep,
                   Visit visit) {
  if (keep == total) {
    for_each_inside(events, options, visit);
    return;
  }
  std::size_t phase = 0;
  for_each_inside(events, options, [&](const Event& event) {
    phase += keep;
    if (phase < total) return;
    phase -= total;
    visit(event);
  });
}

std::size_t cell_of(const Event& event, std::size_t cols, std::size_t cells) {
  const auto row = static_cast<std::size_t>(event.y >> kCloudCellShift);
  const auto col = static_cast<std::size_t>(event.x >> kCloudCellShift);
  return (event.polarity != 0 ? cells : 0) + row * cols + col;
}

/// Counts the events of each cell, one place ahead: of those on the sensor, or, where there are more than `room`, of
/// those that are kept. @return how many are on the sensor
std::size_t count_events(Span<const Event> events, const CloudOptions& options, std::size_t cols, std::size_t room,
                         Span<std::uint32_t> start) {
  const std::size_t cells = start.size() / 2;
  const auto count_event = [&](const Event& event) { ++start[cell_of(event, cols, cells) + 1]; };
  for (std::uint32_t& count : start) count = 0;
  std::size_t inside = 0;
  for_each_inside(events, options, [&](const Event& event) {
    count_event(event);
    ++inside;
  });
  if (inside > room) {
    for (std::uint32_t& count : start) count = 0;
    for_each_kept(events, options, inside, room, count_event);
  }
  return inside;
}

/// From counts to where each begins: the exclusive prefix sum of all but the first.
void set_starts(Span<std::uint32_t> counts) {
  std::uint32_t sum = 0;
  for (std::size_t c = 1; c < counts.size(); ++c) {
    const std::uint32_t count = counts[c];
    counts[c] = sum;
    sum += count;
  }
}

/// Events per px^2 that chance puts into the cells of one polarity. Cells that the sensor's border cuts hold fewer, so
/// that only a sensor without whole ones is measured by them.
float noise_floor(const EventCloud& cloud, std::size_t first_cell) {
  std::uint32_t histogram[kMaxQuietCount + 1] = {};
  const auto whole_cols = static_cast<std::size_t>(std::max(1, cloud.width >> kCloudCellShift));
  const auto whole_rows = static_cast<std::size_t>(std::max(1, cloud.height >> kCloudCellShift));
  for (std::size_t row = 0; row < whole_rows; ++row) {
    const std::uint32_t* const start = &cloud.cell_start[first_cell + row * cloud.cols];
    for (std::size_t col = 0; col < whole_cols; ++col) {
      ++histogram[std::min(start[col + 1] - start[col], kMaxQuietCount)];
    }
  }
  const float area = static_cast<float>(std::min<int>(kCloudCellPx, cloud.width)) *
                     static_cast<float>(std::min<int>(kCloudCellPx, cloud.height));
  return poisson_floor({histogram, kMaxQuietCount + 1}, kQuietShare) / area;
}

bool valid(const EventWindow& window, const CloudOptions& options) {
  return options.width > 0 && options.height > 0 && options.width <= kMaxSensorSide &&
         options.height <= kMaxSensorSide && options.c_z_us_per_px >= 0 && options.auto_depth_px > 0 &&
         window.end_us > window.begin_us && distance_us(window.begin_us, window.end_us) <= kLongestUs;
}

}  // namespace

Status build_cloud(const EventWindow& window, const CloudOptions& options, const CloudWorkspace& workspace,
                   EventCloud* cloud, CloudStats* stats) {
  CloudStats unused;
  if (stats == nullptr) stats = &unused;
  *stats = {};
  if (!valid(window, options)) return Status::invalid_argument;
  const std::size_t cells = cloud_cells(options.width, options.height);
  if (workspace.cell_start.size() < 2 * cells + 1 || workspace.x.empty()) return Status::buffer_too_small;

  // Counts stand one place ahead: once they are summed up start[c + 1] is where cell c begins, and the scatter moves it
  // to where cell c ends, which is where cell c + 1 begins.
  const Span<std::uint32_t> start = workspace.cell_start.first(2 * cells + 1);
  const auto cols = static_cast<std::size_t>((options.width + kCloudCellPx - 1) >> kCloudCellShift);
  const std::size_t inside = count_events(window.events, options, cols, workspace.x.size(), start);
  const std::size_t kept = std::min(inside, workspace.x.size());
  stats->events = static_cast<std::uint32_t>(window.events.size());
  stats->outside_sensor = static_cast<std::uint32_t>(window.events.size() - inside);
  stats->thinned = static_cast<std::uint32_t>(inside - kept);
  set_starts(start);

  const std::int64_t window_us = window.end_us - window.begin_us;
  const auto length_us = static_cast<float>(window_us);
  const float c_z = options.c_z_us_per_px > 0 ? options.c_z_us_per_px : length_us / options.auto_depth_px;
  const float per_us = 1.0F / c_z;
  const float depth_px = length_us * per_us;
  if (!(depth_px > 0)) return Status::invalid_argument;
  // Times are converted from 32 bits, since small processors do 64 in software; longer windows are told in coarser
  // units.
  int shift = 0;
  while (window_us >> shift > std::numeric_limits<std::int32_t>::max()) ++shift;
  const float ticks_per_unit = static_cast<float>(kCloudTicks) / static_cast<float>(window_us >> shift);
  for_each_kept(window.events, options, inside, kept, [&](const Event& event) {
    const std::uint32_t i = start[cell_of(event, cols, cells) + 1]++;
    auto since_us = static_cast<std::int64_t>(distance_us(window.begin_us, event.t_us));
    if (static_cast<std::uint64_t>(since_us) > static_cast<std::uint64_t>(window_us))
      since_us = since_us < 0 ? 0 : window_us;
    const auto units = static_cast<std::int32_t>(shift == 0 ? since_us : since_us >> shift);
    const float t = static_cast<float>(units) * ticks_per_unit + 0.5F;
    workspace.x[i] = event.x;
    workspace.y[i] = event.y;
    workspace.t[i] = static_cast<std::uint16_t>(t);  // at most kCloudTicks: three roundings add less than half
  });

  cloud->x = {workspace.x.data(), kept};
  cloud->y = {workspace.y.data(), kept};
  cloud->t = {workspace.t.data(), kept};
  cloud->cell_start = {start.data(), 2 * cells + 1};
  cloud->width = options.width;
  cloud->height = options.height;
  cloud->cols = static_cast<std::uint16_t>(cols);
  cloud->rows = static_cast<std::uint16_t>(cells / cols);
  cloud->depth_px = depth_px;
  cloud->kept_share = inside > 0 ? static_cast<float>(kept) / static_cast<float>(inside) : 1;
  cloud->noise_floor[0] = noise_floor(*cloud, 0);
  cloud->noise_floor[1] = noise_floor(*cloud, cells);
  return Status::ok;
}

}  // namespace lecalib
