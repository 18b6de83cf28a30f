/* SPDX-License-Identifier: MIT */
/* MonoCalibrator for C: events in, camera out, in bytes that the caller gives. Nothing allocates. Not for two threads
   at once; an interrupt hands its events to the thread that calls these functions. */
#ifndef LECALIB_C_LECALIB_H
#define LECALIB_C_LECALIB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The values of lecalib::Status, which says what each means; those from LECALIB_FIRST_ERROR on are errors. */
typedef uint8_t lecalib_status;
enum {
  LECALIB_OK = 0,
  LECALIB_IN_PROGRESS = 1,
  LECALIB_NEED_MORE_DATA = 2,
  LECALIB_FIRST_ERROR = 10,
  LECALIB_INVALID_ARGUMENT = 10,
  LECALIB_CAPACITY_EXCEEDED = 11,
  LECALIB_WRONG_STATE = 12,
  LECALIB_BUFFER_TOO_SMALL = 13,
  LECALIB_MALFORMED_INPUT = 20,
  LECALIB_UNSUPPORTED_FORMAT = 21,
  LECALIB_TOO_FEW_LINES = 30,
  LECALIB_DEGENERATE_GEOMETRY = 31,
  LECALIB_NO_MATCH = 32,
  LECALIB_NOT_CONVERGED = 33,
  LECALIB_IMPLAUSIBLE_RESULT = 34,
  LECALIB_UNDETERMINED = 35,
  LECALIB_NUMERICAL_FAILURE = 36,
  LECALIB_IO_ERROR = 40
};
/* A status' name, e.g. "too_few_lines". Never null. */
const char* lecalib_status_name(lecalib_status status);

/* One thing to do next; the values of lecalib::CoverageHint. */
typedef uint8_t lecalib_coverage_hint;
enum {
  LECALIB_HINT_NONE = 0,
  LECALIB_HINT_SHOW_OBJECT = 1,
  LECALIB_HINT_MOVE = 2,
  LECALIB_HINT_FILL_LEFT = 3,
  LECALIB_HINT_FILL_RIGHT = 4,
  LECALIB_HINT_FILL_TOP = 5,
  LECALIB_HINT_FILL_BOTTOM = 6,
  LECALIB_HINT_TILT = 7,
  LECALIB_HINT_ROLL = 8,
  LECALIB_HINT_COME_CLOSER = 9,
  LECALIB_HINT_MOVE_AWAY = 10,
  LECALIB_HINT_MORE_CONTRAST = 11,
  LECALIB_HINT_ENOUGH = 12
};
/* A hint's name, e.g. "fill_left". Never null. */
const char* lecalib_hint_name(lecalib_coverage_hint hint);

typedef struct {
  int64_t t_us;
  uint16_t x, y;
  uint8_t polarity; /* 1 ON (brighter), 0 OFF (darker) */
} lecalib_event;

/* A straight edge of the object, metres, in any frame that is fixed to it. */
typedef struct {
  double p[3], q[3];
} lecalib_model_line;

/* How much a calibrator can hold, see lecalib::Capacities. */
typedef struct {
  uint16_t sensor_width, sensor_height; /* px */
  uint32_t events_per_window, lines_per_window, windows, model_lines;
  bool edges;
} lecalib_capacities;

typedef struct {
  /* fx fy cx cy k1 k2 p1 p2 k3, ideal to distorted by Brown's model with OpenCV's names. */
  double intrinsics[9];
  double sigma[9]; /* one sigma; 0 for a held parameter */
  double rms_px;
  uint32_t views;
} lecalib_camera;

typedef struct lecalib_calibrator lecalib_calibrator;

/* Bytes that lecalib_init() needs. */
size_t lecalib_required_bytes(const lecalib_capacities* capacities);

/* Makes a calibrator with the default options; another one may follow in the same bytes.
   memory: aligned for every type; it, and the model, must outlive the calibrator, which needs no clean-up.
   Returns what MonoCalibrator::init() does; *out is the calibrator if that is LECALIB_OK. */
lecalib_status lecalib_init(void* memory, size_t bytes, const lecalib_capacities* capacities,
                            const lecalib_model_line* model, size_t model_lines, lecalib_calibrator** out);

/* Takes events from the front: moves *events and lowers *count.
   Returns LECALIB_OK (all taken) or LECALIB_IN_PROGRESS (call lecalib_step() before the rest is pushed). */
lecalib_status lecalib_push(lecalib_calibrator* calibrator, const lecalib_event** events, size_t* count);

/* No more events come: further calls of lecalib_step() solve. */
lecalib_status lecalib_finish(lecalib_calibrator* calibrator);

/* A bounded piece of work.
   Returns LECALIB_IN_PROGRESS (call it again), LECALIB_NEED_MORE_DATA (push or finish), LECALIB_OK (there is a camera),
   or why there is none. */
lecalib_status lecalib_step(lecalib_calibrator* calibrator);

/* 0 to 1, never 1 before success. It stays at 0 while events are collected. */
float lecalib_progress(const lecalib_calibrator* calibrator);

/* What would help most now, at any time: see MonoCalibrator::coverage(). Takes some thousand line projections once the
   object is found. */
lecalib_coverage_hint lecalib_hint(const lecalib_calibrator* calibrator);

/* Returns LECALIB_OK, or what the last lecalib_step() said; *out is then the refused camera, where there is one. */
lecalib_status lecalib_result(const lecalib_calibrator* calibrator, lecalib_camera* out);

#ifdef __cplusplus
}
#endif

#endif
