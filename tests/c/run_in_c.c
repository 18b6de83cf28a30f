/* SPDX-License-Identifier: MIT */
#include "c/run_in_c.h"

lecalib_status run_in_c(void* memory, size_t bytes, const lecalib_capacities* capacities,
                        const lecalib_model_line* model, size_t model_lines, const lecalib_event* events, size_t count,
                        lecalib_calibrator** made, lecalib_camera* camera) {
  lecalib_calibrator* calibrator = NULL;
  lecalib_status status = lecalib_init(memory, bytes, capacities, model, model_lines, &calibrator);
  if (status != LECALIB_OK) return status;
  *made = calibrator;
  while ((status = lecalib_push(calibrator, &events, &count)) == LECALIB_IN_PROGRESS) {
    while (lecalib_step(calibrator) == LECALIB_IN_PROGRESS) {
    }
  }
  if (status != LECALIB_OK) return status;
  status = lecalib_finish(calibrator);
  if (status != LECALIB_OK) return status;
  while (lecalib_step(calibrator) == LECALIB_IN_PROGRESS) {
  }
  return lecalib_result(calibrator, camera);
}
