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

namespace {

using lecalib::CoverageHint;
using lecalib::Status;

constexpr bool is_same(int value, Status status) { return value == static_cast<int>(status); }
constexpr bool is_same(int value, CoverageHint hint) { return value == static_cast<int>(hint); }

static_assert(is_same(LECALIB_OK, Status::ok) && is_same(LECALIB_IN_PROGRESS, Status::in_progress) &&
              is_same(LECALIB_NEED_MORE_DATA, Status::need_more_data) &&
              is_same(LECALIB_INVALID_ARGUMENT, Status::invalid_argument) &&
              is_same(LECALIB_CAPACITY_EXCEEDED, Status::capacity_exceeded) &&
              is_same(LECALIB_WRONG_STATE, Status::wrong_state) &&
              is_same(LECALIB_BUFFER_TOO_SMALL, Status::buffer_too_small) &&
              is_same(LECALIB_MALFORMED_INPUT, Status::malformed_input) &&
              is_same(LECALIB_UNSUPPORTED_FORMAT, Status::unsupported_format) &&
              is_same(LECALIB_TOO_FEW_LINES, Status::too_few_lines) &&
              is_same(LECALIB_DEGENERATE_GEOMETRY, Status::degenerate_geometry) &&
              is_same(LECALIB_NO_MATCH, Status::no_match) && is_same(LECALIB_NOT_CONVERGED, Status::not_converged) &&
              is_same(LECALIB_IMPLAUSIBLE_RESULT, Status::implausible_result) &&
              is_same(LECALIB_UNDETERMINED, Status::undetermined) &&
              is_same(LECALIB_NUMERICAL_FAILURE, Status::numerical_failure) &&
              is_same(LECALIB_IO_ERROR, Status::io_error));
static_assert(is_same(LECALIB_FIRST_ERROR, Status::invalid_argument));
static_assert(is_same(LECALIB_HINT_NONE, CoverageHint::none) &&
              is_same(LECALIB_HINT_SHOW_OBJECT, CoverageHint::show_object) &&
              is_same(LECALIB_HINT_MOVE, CoverageHint::move) &&
              is_same(LECALIB_HINT_FILL_LEFT, CoverageHint::fill_left) &&
              is_same(LECALIB_HINT_FILL_RIGHT, CoverageHint::fill_right) &&
              is_same(LECALIB_HINT_FILL_TOP, CoverageHint::fill_top) &&
              is_same(LECALIB_HINT_FILL_BOTTOM, CoverageHint::fill_bottom) &&
              is_same(LECALIB_HINT_TILT, CoverageHint::tilt) && is_same(LECALIB_HINT_ROLL, CoverageHint::roll) &&
              is_same(LECALIB_HINT_COME_CLOSER, CoverageHint::come_closer) &&
              is_same(LECALIB_HINT_MOVE_AWAY, CoverageHint::move_away) &&
              is_same(LECALIB_HINT_MORE_CONTRAST, CoverageHint::more_contrast) &&
              is_same(LECALIB_HINT_ENOUGH, CoverageHint::enough));
static_assert(lecalib::kNumCoverageHints == LECALIB_HINT_ENOUGH + 1);

lecalib::Capacities capacities_of(const lecalib_capacities& c) {
  lecalib::Capacities out;
  out.sensor_width = c.sensor_width, out.sensor_height = c.sensor_height;
  out.events_per_window = c.events_per_window, out.lines_per_window = c.lines_per_window;
  out.windows = c.windows, out.model_lines = c.model_lines;
  out.edges = c.edges;
  return out;
}

lecalib_status value_of(Status status) { return static_cast<lecalib_status>(status); }

constexpr std::size_t kCalibratorBytes = lecalib::detail::align_up(sizeof(lecalib_calibrator), lecalib::kArenaAlign);

}  // namespace

const char* lecalib_status_name(lecalib_status status) { return to_string(static_cast<Status>(status)); }

const char* lecalib_hint_name(lecalib_coverage_hint hint) { return to_string(static_cast<CoverageHint>(hint)); }

size_t lecalib_required_bytes(const lecalib_capacities* capacities) {
  return kCalibratorBytes + lecalib::required_bytes(capacities_of(*capacities));
}

lecalib_status lecalib_init(void* memory, size_t bytes, const lecalib_capacities* capacities,
                            const lecalib_model_line* model, size_t model_lines, lecalib_calibrator** out) {
  const bool aligned = reinterpret_cast<std::uintptr_t>(memory) % lecalib::kArenaAlign == 0;
  if (bytes < kCalibratorBytes || !aligned) return value_of(Status::buffer_too_small);
  auto* const calibrator = new (memory) lecalib_calibrator();
  const lecalib::Span<std::byte> rest(static_cast<std::byte*>(memory) + kCalibratorBytes, bytes - kCalibratorBytes);
  const lecalib::Span<const lecalib::ModelLine> lines(reinterpret_cast<const lecalib::ModelLine*>(model), model_lines);
  const Status status = calibrator->mono.init(rest, capacities_of(*capacities), {}, lines);
  if (status == Status::ok) *out = calibrator;
  return value_of(status);
}

lecalib_status lecalib_push(lecalib_calibrator* calibrator, const lecalib_event** events, size_t* count) {
  lecalib::Span<const lecalib::Event> rest(reinterpret_cast<const lecalib::Event*>(*events), *count);
  const Status status = calibrator->mono.push(&rest);
  *events += *count - rest.size();
  *count = rest.size();
  return value_of(status);
}

lecalib_status lecalib_finish(lecalib_calibrator* calibrator) { return value_of(calibrator->mono.finish()); }

lecalib_status lecalib_step(lecalib_calibrator* calibrator) { return value_of(calibrator->mono.step()); }

float lecalib_progress(const lecalib_calibrator* calibrator) { return calibrator->mono.progress(); }

lecalib_coverage_hint lecalib_hint(const lecalib_calibrator* calibrator) {
  return static_cast<lecalib_coverage_hint>(calibrator->mono.coverage().hints[0]);
}

lecalib_status lecalib_result(const lecalib_calibrator* calibrator, lecalib_camera* out) {
  lecalib::CalibrationResult result;
  const Status status = calibrator->mono.result(&result);
  for (std::size_t i = 0; i < lecalib::kNumIntrinsics; ++i) {
    out->intrinsics[i] = result.camera.*lecalib::kIntrinsics[i];
    out->sigma[i] = result.sigma[i];
  }
  out->rms_px = result.rms_px;
  out->views = static_cast<uint32_t>(result.views.size());
  return value_of(status);
}
