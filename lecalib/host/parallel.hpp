// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>

namespace lecalib::host {

/// Runs work(0) ... work(count - 1) on this thread and on threads - 1 more, each index once, in no particular order.
/// What one call does must not depend on another. An exception of a call ends all and is thrown here.
/// @param progress may be empty; called on this thread with the number of indices begun so far
/// @param threads  at least 1
void parallel_for(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work,
                  const std::function<void(std::size_t)>& progress = {});

}  // namespace lecalib::host
