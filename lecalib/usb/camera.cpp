// SPDX-License-Identifier: MIT
#include "lecalib/usb/camera.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include "lecalib/usb/fx3_camera.hpp"
#include "lecalib/usb/treuzell_camera.hpp"

namespace lecalib::usb {
namespace {

using Opened = host::Result<std::unique_ptr<Camera>>;

/// A kind of device that is a camera, or would be one.
struct CameraKind {
  std::uint16_t vendor;
  std::uint16_t product;
  const char* name;
  Opened (*open)(std::unique_ptr<Transport>, const char* name);  ///< null: it cannot be used as it is
};

// 70-lecalib.rules names the same ids.
constexpr CameraKind kKinds[] = {
    {0x04B4, 0x00F5, "Prophesee EVK4", &open_treuzell},
    {0x04B4, 0x00F4, "Prophesee EVK3", &open_treuzell},
    {0x31F7, 0x0003, "CenturyArks SilkyEvCam HD", &open_treuzell},
    {0x1409, 0x8E00, "IDS uEye XCP-E", &open_treuzell},
    {0x152A, 0x841A, "iniVation DAVIS346", &open_davis346},
    {0x152A, 0x8419, "iniVation DVXplorer", &open_dvxplorer},
    {0x04B4, 0x00F3, "boot loader of a camera", nullptr},
    {0x04B4, 0x4720, "boot loader of a camera", nullptr},
};

const CameraKind* kind_of(const DeviceInfo& device) {
  const auto* const kind = std::find_if(std::begin(kKinds), std::end(kKinds), [&](const CameraKind& k) {
    return k.vendor == device.vendor && k.product == device.product;
  });
  return kind == std::end(kKinds) ? nullptr : kind;
}

Opened open_device(Bus* bus, const DeviceInfo& device) {
  const CameraKind& kind = *kind_of(device);
  if (kind.open == nullptr) {
    return host::Error{"it has no firmware: load it with its maker's tool, then plug it in anew"};
  }
  std::unique_ptr<Transport> transport;
  const UsbStatus status = bus->open(device, &transport);
  if (status != UsbStatus::ok) return host::Error{to_string(status), {}, 0, 0, {}, Status::io_error};
  return kind.open(std::move(transport), kind.name);
}

host::Result<std::vector<DeviceInfo>> plugged_in(Bus* bus) {
  std::vector<DeviceInfo> devices;
  const UsbStatus status = bus->list(&devices);
  if (status != UsbStatus::ok) return host::Error{std::string("cannot list USB devices: ") + to_string(status)};
  const auto is_none = [](const DeviceInfo& device) { return kind_of(device) == nullptr; };
  devices.erase(std::remove_if(devices.begin(), devices.end(), is_none), devices.end());
  const auto place = [](const DeviceInfo& device) { return std::make_pair(device.bus, device.address); };
  std::sort(devices.begin(), devices.end(),
            [&](const DeviceInfo& a, const DeviceInfo& b) { return place(a) < place(b); });
  return devices;
}

bool is_same_serial(const std::string& a, const std::string& b) {
  const auto same = [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

/// Which cameras there are, for somebody who asked for one that is not.
std::string serials_of(const std::vector<CameraInfo>& cameras) {
  std::string text;
  for (const CameraInfo& camera : cameras) {
    if (!text.empty()) text += ", ";
    text += camera.serial.empty() ? camera.name + " (" + camera.problem + ")" : camera.serial;
  }
  return text;
}

}  // namespace

host::Result<std::vector<CameraInfo>> list_cameras(Bus* bus) {
  const auto devices = plugged_in(bus);
  if (!devices.ok()) return devices.error();
  std::vector<CameraInfo> cameras;
  for (const DeviceInfo& device : devices.value()) {
    const Opened opened = open_device(bus, device);
    if (opened.ok()) {
      cameras.push_back(opened.value()->info());
    } else {
      cameras.push_back({device, kind_of(device)->name, {}, {}, opened.error().message});
    }
  }
  return cameras;
}

host::Result<std::unique_ptr<Camera>> open_camera(Bus* bus, const std::string& serial) {
  const auto devices = plugged_in(bus);
  if (!devices.ok()) return devices.error();
  if (devices.value().empty()) return host::Error{"no camera is plugged in"};
  if (devices.value().size() == 1 && serial.empty()) {
    const DeviceInfo& only = devices.value().front();
    Opened opened = open_device(bus, only);
    if (opened.ok()) return opened;
    return host::Error{std::string("cannot use the ") + kind_of(only)->name + ": " + opened.error().message};
  }
  std::vector<CameraInfo> others;
  for (const DeviceInfo& device : devices.value()) {
    Opened opened = open_device(bus, device);
    if (!opened.ok()) {
      others.push_back({device, kind_of(device)->name, {}, {}, opened.error().message});
    } else if (!serial.empty() && is_same_serial(opened.value()->info().serial, serial)) {
      return opened;
    } else {
      others.push_back(opened.value()->info());
    }
  }
  const std::string found = serials_of(others);
  if (!serial.empty()) return host::Error{"no camera has the serial number " + serial + ", there is " + found};
  return host::Error{"choose a camera with --serial: there are " + found};
}

}  // namespace lecalib::usb
