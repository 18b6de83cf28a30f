// SPDX-License-Identifier: MIT
/// What the program needs of the board that it runs on.
#pragma once

#include <cstddef>

namespace board {

/// Writes text where the developer sees it.
void print(const char* text);

/// Bytes of the stack that were ever used; 0 where nobody knows.
std::size_t stack_used();

}  // namespace board
