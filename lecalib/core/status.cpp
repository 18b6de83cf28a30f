// SPDX-License-Identifier: MIT
#include "lecalib/core/status.hpp"

namespace lecalib {

const char* to_string(Status status) noexcept {
  switch (status) {
    case Status::ok: return "ok";
    case Status::in_progress: return "in_progress";
    case Status::need_more_data: return "need_more_data";
    case Status::invalid_argument: return "invalid_argument";
    case Status::capacity_exceeded: return "capacity_exceeded";
    case Status::wrong_state: return "wrong_state";
    case Status::buffer_too_small: return "buffer_too_small";
    case Status::malformed_input: return "malformed_input";
    case Status::unsupported_format: return "unsupported_format";
    case Status::too_few_lines: return "too_few_lines";
    case Status::degenerate_geometry: return "degenerate_geometry";
    case Status::no_match: return "no_match";
    case Status::not_converged: return "not_converged";
    case Status::implausible_result: return "implausible_result";
    case Status::undetermined: return "undetermined";
    case Status::numerical_failure: return "numerical_failure";
    case Status::io_error: return "io_error";
  }
  return "unknown";
}

}  // namespace lecalib
