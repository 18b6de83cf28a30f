// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace lecalib {

/// Whether a call worked. How good an answer is stands in the result itself (sigma, rms, counts).
/// The values are stable: they may be stored and sent.
enum class [[nodiscard]] Status : std::uint8_t{
    ok = 0,
    in_progress = 1,     ///< more calls of the same function are needed; not an error
    need_more_data = 2,  ///< the input given so far is used up; not an error

    invalid_argument = 10,   ///< an option or argument is outside of its documented range
    capacity_exceeded = 11,  ///< an output or workspace was too small for all of the answer; what fits is there
    wrong_state = 12,        ///< the call does not fit the object's state (see its documentation)
    buffer_too_small = 13,   ///< the memory given is smaller than required_bytes()

    malformed_input = 20,     ///< bytes that no writer of the format produces
    unsupported_format = 21,  ///< a format that is recognised but not read, or not recognised

    too_few_lines = 30,        ///< fewer lines or views than the unknowns need
    degenerate_geometry = 31,  ///< the lines' arrangement leaves the solution undefined
    no_match = 32,             ///< detected lines could not be tied to the model's
    not_converged = 33,        ///< the iteration limit came before convergence
    implausible_result = 34,   ///< converged to a camera outside of the plausible range
    undetermined = 35,         ///< the data leave a parameter more uncertain than the caller allows
    numerical_failure = 36,    ///< a value became infinite or not a number

    io_error = 40,  ///< host only: the operating system refused
};

/// True for everything but ok, in_progress and need_more_data.
constexpr bool is_error(Status status) noexcept { return status > Status::need_more_data; }

/// The enumerator's name, e.g. "too_few_lines". Never null.
const char* to_string(Status status) noexcept;

}  // namespace lecalib
