// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "lecalib/host/error.hpp"
#include "lecalib/usb/transport.hpp"

namespace lecalib::usb {

/// The devices of this machine, by libusb-1.0. A stream keeps a ring of transfers in the hands of the operating system;
/// one thread of its own takes what they bring. A halted endpoint is cleared and the stream goes on; transfers that the
/// system has no memory for are made fewer and smaller.
host::Result<std::unique_ptr<Bus>> make_libusb_bus();

}  // namespace lecalib::usb
