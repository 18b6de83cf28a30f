// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "lecalib/host/error.hpp"
#include "lecalib/usb/transport.hpp"

namespace lecalib::usb {

/// A setting of an iniVation camera: 32 bits in one of its modules.
struct Fx3Parameter {
  std::uint16_t module;
  std::uint16_t number;
};

/// How iniVation's cameras with an FX3 are told and asked: vendor requests on endpoint 0, most significant byte first.
class Fx3Link {
 public:
  explicit Fx3Link(Transport* transport) : transport_(transport) {}

  host::Result<std::uint32_t> read(Fx3Parameter parameter);
  host::MaybeError write(Fx3Parameter parameter, std::uint32_t value);

 private:
  Transport* transport_;
};

}  // namespace lecalib::usb
