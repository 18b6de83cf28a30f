// SPDX-License-Identifier: MIT
/// What to write into the registers of an IMX636, in which order. Nothing here was tried on a sensor: it restates what
/// the public drivers do that are named below.
#pragma once

#include <cstdint>

#include "lecalib/core/span.hpp"

namespace lecalib::usb {

struct RegisterStep {
  std::uint32_t address;
  std::uint32_t value;
  std::uint32_t mask = 0;     ///< only these bits change; 0: the whole register
  std::uint32_t wait_us = 0;  ///< afterwards
};

// From OpenEB 5.1.1 (Apache-2.0, imx636_evk3_issd.h), the maker's. Of its waits, 2.5 s in all, neuromorphic-drivers
// 6c2018e (MIT, prophesee_evk4.rs) takes each one line later.
Span<const RegisterStep> imx636_stop() noexcept;
Span<const RegisterStep> imx636_destroy() noexcept;
Span<const RegisterStep> imx636_init() noexcept;
Span<const RegisterStep> imx636_start() noexcept;

// From neuromorphic-drivers 6c2018e.
/// Anti-flicker and trail filter out of the way, external trigger on.
Span<const RegisterStep> imx636_plain_output() noexcept;

/// A run of registers, 4 bytes apart.
struct RegisterBlock {
  std::uint32_t address;
  std::uint32_t count;
};

inline constexpr RegisterBlock kImx636PixelMasks = {0x9100, 64};
inline constexpr RegisterBlock kImx636RoiColumns = {0x2000, 40};  ///< bit set: column off
inline constexpr RegisterBlock kImx636RoiRows = {0x4000, 23};     ///< bit set: row off
inline constexpr RegisterStep kImx636RoiTake = {0x0004, 0xF0005062};

// The event rate controller (ERC).
inline constexpr RegisterStep kImx636ErcHold = {0x6000, 0x00155400};
inline constexpr RegisterStep kImx636ErcRun = {0x6000, 0x00155401};
inline constexpr RegisterBlock kImx636ErcWeights = {0x6800, 230};    ///< 0x08080808 each
inline constexpr RegisterBlock kImx636ErcDropTable = {0x6400, 256};  ///< (2 i + 1) << 16 | 2 i
inline constexpr std::uint32_t kImx636ErcInput = 0x6004;             ///< 1: on
inline constexpr std::uint32_t kImx636ErcPeriod = 0x6008;            ///< us, 10 bits
inline constexpr std::uint32_t kImx636ErcEvents = 0x600C;            ///< per period, 22 bits
inline constexpr std::uint32_t kImx636ErcEnable = 0x6028;            ///< 3: on, 2: off
inline constexpr std::uint32_t kImx636ErcReserved = 0x602C;          ///< 1 while the weights are written, then 2
inline constexpr std::uint32_t kImx636ErcDropTime = 0x6050;          ///< 1: on; the two below stay 0
inline constexpr std::uint32_t kImx636ErcDropColumns = 0x6060;
inline constexpr std::uint32_t kImx636ErcDropRows = 0x6070;

/// A bias: its register holds kImx636BiasWord | value, value 0 to 255.
struct Imx636Bias {
  const char* name;
  std::uint32_t address;
  int min_offset;  ///< what OpenEB allows
  int max_offset;
};

inline constexpr std::uint32_t kImx636BiasWord = 0x11A10000;
Span<const Imx636Bias> imx636_biases() noexcept;

}  // namespace lecalib::usb
