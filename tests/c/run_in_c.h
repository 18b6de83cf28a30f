/* SPDX-License-Identifier: MIT */
#ifndef TESTS_C_RUN_IN_C_H
#define TESTS_C_RUN_IN_C_H

#include "lecalib/c/lecalib.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Calibrates from all events, as a program in C would. *made is the calibrator, in the memory. */
lecalib_status run_in_c(void* memory, size_t bytes, const lecalib_capacities* capacities,
                        const lecalib_model_line* model, size_t model_lines, const lecalib_event* events, size_t count,
                        lecalib_calibrator** made, lecalib_camera* camera);

#ifdef __cplusplus
}
#endif

#endif
