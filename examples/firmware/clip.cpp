// SPDX-License-Identifier: MIT
#include "clip.hpp"

__asm__(
    ".section .clip,\"a\",%progbits\n"
    ".global clip_begin\n"
    ".global clip_end\n"
    "clip_begin: .incbin \"" CLIP_FILE
    "\"\n"
    "clip_end: .byte 0\n"
    ".text\n");

extern "C" const std::uint8_t clip_begin[], clip_end[];

lecalib::Span<const std::uint8_t> clip() { return {clip_begin, static_cast<std::size_t>(clip_end - clip_begin)}; }
