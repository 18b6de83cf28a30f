// SPDX-License-Identifier: MIT
#include "lecalib/host/heap_arena.hpp"

namespace lecalib::host {

// operator new[] aligns to kArenaAlign; the bytes stay uninitialised, so untouched capacity costs no physical memory.
HeapArena::HeapArena(std::size_t bytes) : block_(new std::byte[bytes]), bytes_(bytes) {}

}  // namespace lecalib::host
