// SPDX-License-Identifier: MIT
#include "lecalib/c/lecalib.h"

#include <cstddef>
#include <cstdint>
#include <new>
#include <type_traits>

#include "lecalib/pipeline/mono_calibrator.hpp"

struct lecalib_calibrator {
  lecalib::MonoCalibrator mono;
};
static_assert(std::is_trivially_destructible_v<lecalib_calibrator>);

// Arrays of these pass as they are.
static_assert(sizeof(lecalib_event) == sizeof(lecalib::Event) &&
              offsetof(lecalib_event, polarity) == offsetof(lecalib::Event, polarity));
static_assert(sizeof(lecalib_model_line) == sizeof(lecalib::ModelLine));
static_assert(LECALIB_NEED_MORE_DATA == static_cast<int>(lecalib::Status::need_more_data));

namespace {

lecalib::Capacities capacities_of(const lecalib_capacities& c) {
  lecalib::Capacities out;
  out.sensor_width = c.sensor_width, out.sensor_height = c.sensor_height;
  out.events_per_window = c.events_per_window, out.lines_per_window = c.lines_per_window;
  out.windows = c.windows, out.model_lines = c.model_lines;
  out.edges = c.edges;
  return out;
}

lecalib_status value_of(lecalib::Status status) { return static_cast<lecalib_status>(status); }

constexpr std::size_t kCalibratorBytes = lecalib::detail::align_up(sizeof(lecalib_calibrator), lecalib::kArenaAlign);

}  // namespace

const char* lecalib_status_name(lecalib_status status) { return to_string(static_cast<lecalib::Status>(status)); }

size_t lecalib_required_bytes(const lecalib_capacities* capacities) {
  return kCalibratorBytes + lecalib::required_bytes(capacities_of(*capacities));
}

lecalib_status lecalib_init(void* memory, size_t bytes, const lecalib_capacities* capacities,
                            const lecalib_model_line* model, size_t model_lines, lecalib_calibrator** out) {
  const bool aligned = reinterpret_cast<std::uintptr_t>(memory) % lecalib::kArenaAlign == 0;
  if (bytes < kCalibratorBytes || !aligned) return value_of(lecalib::Status::buffer_too_small);
  auto* const calibrator = new (memory) lecalib_calibrator();
  const lecalib::Span<std::byte> rest(static_cast<std::byte*>(memory) + kCalibratorBytes, bytes - kCalibratorBytes);
  const lecalib::Span<const lecalib::ModelLine> lines(reinterpret_cast<const lecalib::ModelLine*>(model), model_lines);
  const lecalib::Status status = calibrator->mono.init(rest, capacities_of(*capacities), {}, lines);
  if (status == lecalib::Status::ok) *out = calibrator;
  return value_of(status);
}

lecalib_status lecalib_push(lecalib_calibrator* calibrator, const lecalib_event** events, size_t* count) {
  lecalib::Span<const lecalib::Event> rest(reinterpret_cast<const lecalib::Event*>(*events), *count);
  const lecalib::Status status = calibrator->mono.push(&rest);
  *events += *count - rest.size();
  *count = rest.size();
  return value_of(status);
}

lecalib_status lecalib_finish(lecalib_calibrator* calibrator) { return value_of(calibrator->mono.finish()); }

lecalib_status lecalib_step(lecalib_calibrator* calibrator) { return value_of(calibrator->mono.step()); }

lecalib_status lecalib_result(const lecalib_calibrator* calibrator, lecalib_camera* out) {
  lecalib::CalibrationResult result;
  const lecalib::Status status = calibrator->mono.result(&result);
  for (std::size_t i = 0; i < lecalib::kNumIntrinsics; ++i) {
    out->intrinsics[i] = result.camera.*lecalib::kIntrinsics[i];
    out->sigma[i] = result.sigma[i];
  }
  out->rms_px = result.rms_px;
  out->views = static_cast<uint32_t>(result.views.size());
  return value_of(status);
}
