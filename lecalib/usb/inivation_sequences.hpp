// SPDX-License-Identifier: MIT
/// What to write into the parameters of iniVation's cameras, in which order. Nothing here was tried on a camera: it
/// restates what the public drivers do that are named below.
#pragma once

#include <cstdint>

#include "lecalib/core/span.hpp"
#include "lecalib/usb/fx3_link.hpp"

namespace lecalib::usb {

struct ParameterStep {
  Fx3Parameter parameter;
  std::uint32_t value;
  std::uint32_t wait_us = 0;  ///< afterwards
};

// Parameters of both cameras.
inline constexpr Fx3Parameter kFx3Columns = {1, 0};      ///< of the chip
inline constexpr Fx3Parameter kFx3Rows = {1, 1};         ///< of the chip
inline constexpr Fx3Parameter kFx3Orientation = {1, 2};  ///< bit 2: columns of the chip are rows of the image
inline constexpr Fx3Parameter kFx3ImuType = {3, 0};
inline constexpr Fx3Parameter kFx3ImuOrientation = {3, 1};  ///< bits 2, 1, 0: x, y, z point the other way
inline constexpr Fx3Parameter kFx3Logic = {6, 0};           ///< version
inline constexpr Fx3Parameter kFx3UsbClock = {6, 5};        ///< MHz
inline constexpr Fx3Parameter kFx3ClockDeviation = {6, 6};  ///< thousandths
inline constexpr Fx3Parameter kFx3LogicPatch = {6, 7};
inline constexpr Fx3Parameter kFx3EarlyPacket = {9, 1};  ///< USB clock cycles after which a part of a transfer goes

// The region of interest of a DAVIS.
inline constexpr Fx3Parameter kDavisHasRoi = {1, 40};
inline constexpr Fx3Parameter kDavisRoiBeginColumn = {1, 41};
inline constexpr Fx3Parameter kDavisRoiBeginRow = {1, 42};
inline constexpr Fx3Parameter kDavisRoiLastColumn = {1, 43};
inline constexpr Fx3Parameter kDavisRoiLastRow = {1, 44};

/// The steps of one camera. Transfers have to wait for data before run() is written.
struct InivationSequences {
  Span<const ParameterStep> stop;    ///< everything off
  Span<const ParameterStep> set_up;  ///< biases, filters, chip
  Span<const ParameterStep> run;
};

/// From neuromorphic-drivers 6c2018e (MIT, inivation_davis346.rs), whose biases are libcaer's (264c576, BSD-2-Clause,
/// davis). Frames, the IMU and the filter for background activity stay off, which both drivers switch on.
InivationSequences davis346_sequences() noexcept;

/// From neuromorphic-drivers (MIT, inivation_dvxplorer.rs); the pins of the biases as libcaer (BSD-2-Clause,
/// dvxplorer.c) sets them. The IMU stays off.
InivationSequences dvxplorer_sequences() noexcept;

}  // namespace lecalib::usb
