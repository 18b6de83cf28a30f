// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace lecalib::host {

/// CPU time of this thread, ns. Fits the clock hooks of the stages.
std::uint64_t thread_cpu_ns();

}  // namespace lecalib::host
