// SPDX-License-Identifier: MIT
/// static_mono FILE: calibrates on a board under Linux while the sensor's thread goes on recording; with static memory,
/// so that nothing can run out later. To copy from: put your driver in the place of Sensor, and your object in that of
/// kBox.
#include <atomic>
#include <cstddef>
#include <cstdio>
#include <thread>

#include "lecalib/events/event_ring.hpp"
#include "lecalib/events/event_stream.hpp"
#include "lecalib/pipeline/mono_calibrator.hpp"

namespace {

using namespace lecalib;

constexpr Capacities kCapacities = [] {
  Capacities c;
  c.sensor_width = c.sensor_height = 320;  // must be the sensor's
  c.events_per_window = 20000, c.lines_per_window = 32, c.windows = 32, c.model_lines = 32;
  return c;
}();
alignas(kArenaAlign) std::byte memory[required_bytes(kCapacities)];
MonoCalibrator calibrator;

EventSlot slots[1 << 16];
EventRing ring;

/// The edges of a box of 0.4 x 0.3 x 0.25 m that the camera sees, metres.
constexpr ModelLine kBox[] = {
    {{0, 0, 0}, {0.4, 0, 0}},  {{0, 0, 0.25}, {0.4, 0, 0.25}}, {{0, 0.3, 0.25}, {0.4, 0.3, 0.25}},
    {{0, 0, 0}, {0, 0.3, 0}},  {{0, 0, 0.25}, {0, 0.3, 0.25}}, {{0.4, 0, 0.25}, {0.4, 0.3, 0.25}},
    {{0, 0, 0}, {0, 0, 0.25}}, {{0.4, 0, 0}, {0.4, 0, 0.25}},  {{0, 0.3, 0}, {0, 0.3, 0.25}}};

/// Stands for the sensor: a thread that gives the events of a recording.
class Sensor {
 public:
  explicit Sensor(const char* path) : file_(std::fopen(path, "rb")), thread_([this] { run(); }) {}
  ~Sensor() {
    thread_.join();
    if (file_ != nullptr) std::fclose(file_);
  }
  Sensor(const Sensor&) = delete;
  Sensor& operator=(const Sensor&) = delete;

  /// Nothing will be pushed any more.
  [[nodiscard]] bool done() const { return done_; }

 private:
  void run() {
    static std::uint8_t bytes[4096];
    static Event events[1024];
    EventStreamDecoder decoder;
    for (std::size_t read = 1; file_ != nullptr && read > 0;) {
      read = std::fread(bytes, 1, sizeof bytes, file_);
      Span<const std::uint8_t> input(bytes, read);
      for (std::size_t count = 1; count > 0;) {
        const Status status = read > 0 ? decoder.decode(&input, events, &count) : decoder.finish(events, &count);
        if (is_error(status)) count = read = 0;
        for (std::size_t i = 0; i < count; ++i) {
          // A file can wait. A sensor cannot: there what push() refuses is lost, and counted.
          while (!ring.push(events[i])) std::this_thread::yield();
        }
      }
    }
    done_ = true;
  }

  std::FILE* file_;
  std::atomic<bool> done_{false};
  std::thread thread_;
};

/// One turn of the main loop. @return in_progress until there is a camera, or a reason why there is none
Status turn(const Sensor& sensor) {
  static Event events[256];
  static Span<const Event> unread;
  static bool finished = false;
  if (!finished && unread.empty()) {
    const bool last = sensor.done();  // before pop(): what is pushed in between is seen then
    unread = {events, ring.pop(events)};
    if (unread.empty()) std::this_thread::yield();
    finished = last && unread.empty();
    if (finished && calibrator.finish() != Status::ok) return Status::wrong_state;
  }
  if (!finished && calibrator.push(&unread) == Status::ok) return Status::in_progress;  // all taken
  return calibrator.step();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: static_mono FILE\n");
    return 2;
  }
  Status status = calibrator.init(memory, kCapacities, {}, kBox);
  if (status == Status::ok) status = ring.init(slots, DropPolicy::newest);
  if (status == Status::ok) {
    const Sensor sensor(argv[1]);
    do status = turn(sensor);
    while (status == Status::in_progress);
  }
  CalibrationResult result;
  if (status == Status::ok) status = calibrator.result(&result);
  std::printf("%s, %zu bytes\n", to_string(status), sizeof memory);
  if (status != Status::ok) return 1;
  for (std::size_t i = 0; i < kNumIntrinsics; ++i) {
    std::printf("%s %.4f +- %.4f\n", kIntrinsicNames[i], result.camera.*kIntrinsics[i], result.sigma[i]);
  }
  return 0;
}
