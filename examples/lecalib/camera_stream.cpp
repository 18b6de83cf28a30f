// SPDX-License-Identifier: MIT
#include "camera_stream.hpp"

#include <algorithm>
#include <cstdio>
#include <thread>
#include <utility>

#include "commands.hpp"
#include "lecalib/host/text.hpp"
#include "lecalib/usb/libusb_transport.hpp"

namespace lecalib::command {
namespace {

using std::chrono::milliseconds;
using Seconds = std::chrono::duration<double>;

constexpr milliseconds kPoll{50};
constexpr milliseconds kLookForCamera{200};
/// Sensors send the time at least every few milliseconds, also where nothing moves.
constexpr std::chrono::seconds kMaxSilence{2};
constexpr std::uint32_t kFullSpeedMbit = 5000;

usb::BiasOffset parse_bias(const std::string& text) {
  const std::vector<host::Field> parts = host::split(text, '=');
  const auto offset = parts.size() == 2 ? host::parse_number(parts[1].text) : std::nullopt;
  if (!offset || *offset != static_cast<int>(*offset)) {
    fail({"--bias: expected NAME=OFFSET, as in diff_on=20, found " + host::quoted(text)});
  }
  return {std::string(parts[0].text), static_cast<int>(*offset)};
}

usb::Roi parse_roi(const std::string& text) {
  std::vector<std::uint16_t> numbers;
  for (const host::Field& field : host::split(text, ',')) {
    const auto number = host::parse_count(field.text);
    if (number && *number <= 0xFFFF) numbers.push_back(static_cast<std::uint16_t>(*number));
  }
  if (numbers.size() != 4 || std::count(text.begin(), text.end(), ',') != 3) {
    fail({"--roi: expected X,Y,WIDTH,HEIGHT in px, found " + host::quoted(text)});
  }
  return {numbers[0], numbers[1], numbers[2], numbers[3]};
}

std::string count_of(std::uint64_t count, const char* what) {
  return count == 0 ? "" : std::to_string(count) + " " + what + "\n";
}

}  // namespace

usb::CameraSettings CameraOptions::settings() const {
  usb::CameraSettings settings;
  for (const std::string& bias : biases) settings.biases.push_back(parse_bias(bias));
  if (!roi.empty()) settings.roi = parse_roi(roi);
  settings.max_events_per_s = max_rate;
  return settings;
}

void add_camera_options(CLI::App* command, CameraOptions* options) {
  command
      ->add_option("--serial", options->serial, "Of the camera, where there are several (lecalib devices lists them)")
      ->type_name("SERIAL");
  command->add_option("--seconds", options->seconds, "How long; without it until Ctrl-C")
      ->type_name("S")
      ->check(CLI::PositiveNumber);
  command->add_option("--bias", options->biases, "Change a bias of the sensor from its usual value, as in diff_on=20")
      ->type_name("NAME=OFFSET")
      ->allow_extra_args(false);
  command->add_option("--roi", options->roi, "Part of the sensor that sends, px")->type_name("X,Y,W,H");
  command->add_option("--max-rate", options->max_rate, "Let the sensor itself drop what is beyond so many events/s")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--reconnect", options->reconnect_s, "Wait so long for a camera that was unplugged to come back (0)")
      ->type_name("S")
      ->check(CLI::NonNegativeNumber);
}

CameraStream::CameraStream(const CameraOptions& options)
    : options_(options),
      bus_(take(usb::make_libusb_bus())),
      camera_(take(usb::open_camera(bus_.get(), options.serial))) {
  serial_ = camera_->info().serial;
  const std::uint32_t speed = camera_->info().device.speed_mbit;
  if (speed > 0 && speed < kFullSpeedMbit) {
    std::fprintf(stderr, "lecalib: the camera is plugged in at %u Mbit/s, it may lose events: use a USB 3 port\n",
                 speed);
  }
  start();
  interrupt_.emplace();
  begin_ = Clock::now();
}

void CameraStream::start() {
  usb::StreamBufferOptions buffer;
  buffer.word_bytes = camera_->word_bytes();
  if (is_error(buffer_.init(buffer))) fail({"cannot make the buffer of the stream"});
  if (const host::MaybeError error = camera_->start(options_.settings(), &buffer_)) {
    fail({"cannot start the camera " + serial_ + ": " + error->message, {}, 0, 0, {}, error->status});
  }
  last_data_ = Clock::now();
}

usb::BufferRing::Buffer CameraStream::read() {
  while (true) {
    const bool is_over = options_.seconds > 0 && elapsed_s() >= options_.seconds;
    if (!is_stopped_ && (is_over || Interrupt::came())) stop("");
    usb::BufferRing::Buffer part;
    switch (buffer_.read(kPoll, &part)) {
      case usb::StreamBuffer::Wait::data:
        last_data_ = Clock::now();
        bytes_ += part.bytes.size();
        return part;
      case usb::StreamBuffer::Wait::nothing:
        if (!is_stopped_ && Clock::now() - last_data_ > kMaxSilence) stop("the camera sends nothing any more");
        break;
      case usb::StreamBuffer::Wait::ended:
        if (is_stopped_) return {};
        if (buffer_.why_ended() != usb::UsbStatus::no_device || !reconnect()) {
          stop(to_string(buffer_.why_ended()));
          return {};
        }
        break;
    }
  }
}

void CameraStream::abandon() {
  if (!is_stopped_) stop("");
  usb::BufferRing::Buffer part;
  while (buffer_.read(milliseconds(0), &part) == usb::StreamBuffer::Wait::data) {
  }
}

void CameraStream::stop(std::string fault) {
  is_stopped_ = true;
  fault_ = std::move(fault);
  camera_->stop();
}

bool CameraStream::reconnect() {
  if (options_.reconnect_s <= 0) return false;
  std::fprintf(stderr, "lecalib: the camera was unplugged, waiting %g s for it to come back\n", options_.reconnect_s);
  const usb::StreamStats over = camera_->stream_stats();
  stats_.stalls += over.stalls;
  stats_.overflows += over.overflows;
  stats_.failures += over.failures;
  dropped_ += buffer_.dropped();
  odd_bytes_ += buffer_.odd_bytes();
  camera_->stop();
  const auto until = Clock::now() + Seconds(options_.reconnect_s);
  while (Clock::now() < until && !Interrupt::came()) {
    auto opened = usb::open_camera(bus_.get(), serial_);
    if (opened.ok()) {
      camera_ = std::move(opened).value();
      start();
      ++restarts_;
      std::fprintf(stderr, "lecalib: the camera is back\n");
      return true;
    }
    std::this_thread::sleep_for(kLookForCamera);
  }
  return false;
}

double CameraStream::elapsed_s() const { return Seconds(Clock::now() - begin_).count(); }

std::string CameraStream::losses() const {
  const usb::StreamStats now = camera_->stream_stats();
  return count_of(dropped(), "buffers lost: this machine did not keep up") +
         count_of(stats_.overflows + now.overflows, "transfers lost: the camera sent more than it was asked for") +
         count_of(stats_.failures + now.failures, "transfers failed and were repeated") +
         count_of(stats_.stalls + now.stalls, "halts of the camera were cleared") +
         count_of(odd_bytes_ + buffer_.odd_bytes(), "bytes left out that were no whole word");
}

void CameraStream::show(Progress* progress, const std::string& more) const {
  const double elapsed = elapsed_s();
  std::string text = host::fixed(elapsed, 1) + " s";
  if (options_.seconds > 0) text += " of " + host::shortest(options_.seconds);
  const double megabytes = 1e-6 * static_cast<double>(bytes_);
  text += ", " + host::fixed(megabytes, 1) + " MB";
  progress->show(text + (more.empty() ? "" : ", ") + more);
}

}  // namespace lecalib::command
