// SPDX-License-Identifier: MIT
/// What line detection costs and what it finds, side by side: a change that makes it faster by finding less shows.
///
///     bench_lines [--quick] [--seeds N] [[--sensor WxH] RECORDING...]
///
/// --sensor is for the recordings behind it.
/// Times are CPU times in ns per event of the window, thinned ones included. The exit code is 1 when the easy case is
/// not solved; times are for the reader.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "bench/detector_run.hpp"

namespace {

using namespace lecalib;
using namespace lecalib::bench;

constexpr double kEasyRecall = 0.9;

struct Settings {
  std::vector<std::size_t> lines = {5, 10, 25};
  std::vector<std::size_t> events = {20'000, 100'000, 1'000'000};
  std::vector<std::size_t> worst_events = {20'000, 60'000, 307'200};  ///< the last: one for each pixel
  std::uint64_t seeds = 3;
  int repeats = 5;
  struct Recording {
    std::string path, sensor;
  };
  std::vector<Recording> recordings;
};

constexpr std::size_t kThinning = DetectorCapacities().events;

/// The detector's default, and one that holds all events where that thins.
std::vector<std::size_t> capacities_for(std::size_t events) {
  return events > kThinning ? std::vector<std::size_t>{kThinning, events} : std::vector<std::size_t>{kThinning};
}

const char* name_of(LineFinder finder) { return finder == fast_detector ? "fast" : "reference"; }
constexpr LineFinder kFinders[] = {fast_detector, reference_detector};

void print_heading() {
  std::printf("%-16s %9s %9s %-9s %6s %6s %6s %8s", "scene", "events", "capacity", "detector", "recall", "prec", "px",
              "ns/event");
  for (std::size_t i = 0; i < kNumDetectorStages; ++i) {
    std::printf(" %8s", to_string(static_cast<DetectorStage>(i)));
  }
  std::printf(" %8s %8s\n", "ms", "B/event");
}

void print_row(const std::vector<Scene>& scenes, LineFinder finder, std::size_t capacity, const Measurement& m) {
  const auto count = static_cast<double>(scenes.size());
  std::printf("%-16s %9.0f %9zu %-9s", scenes.front().name.c_str(), m.events / count, capacity, name_of(finder));
  if (m.quality.is_known()) {
    std::printf(" %6.3f %6.3f %6.3f", m.quality.recall(), m.quality.precision(), m.quality.median_px());
  } else {
    std::printf(" %6s %6s %6s", "-", "-", "-");
  }
  std::printf(" %8.1f", m.total_ns / m.events);
  for (const double ns : m.stage_ns) {
    if (ns > 0) {
      std::printf(" %8.1f", ns / m.events);
    } else {
      std::printf(" %8s", "-");
    }
  }
  std::printf(" %8.2f %8.1f\n", 1e-6 * m.total_ns / count, m.bytes_per_event);
  std::fflush(stdout);
}

std::vector<Scene> clusters(std::size_t lines, std::size_t events, double distortion, std::uint64_t seeds) {
  std::vector<Scene> scenes;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    ClusterOptions options;
    options.lines = lines;
    options.events = events;
    options.k1 = options.k2 = distortion;
    options.seed = seed;
    scenes.push_back(make_cluster(options));
    if (distortion != 0) scenes.back().name += ", bent";
  }
  return scenes;
}

/// One line count over all event counts, with each detector, thinning and holding all.
/// @return the least recall
double run_clusters(std::size_t lines, double distortion, const Settings& settings) {
  double least = 1;
  std::vector<Measurement> first[2];
  std::vector<Measurement> last[2];
  for (const std::size_t events : settings.events) {
    const std::vector<Scene> scenes = clusters(lines, events, distortion, settings.seeds);
    for (std::size_t k = 0; k < 2; ++k) {
      last[k].clear();
      for (const std::size_t capacity : capacities_for(events)) {
        last[k].push_back(measure(scenes, kFinders[k], capacity, settings.repeats));
        print_row(scenes, kFinders[k], capacity, last[k].back());
        least = std::fmin(least, last[k].back().quality.recall());
      }
      if (first[k].empty()) first[k] = last[k];
    }
  }
  for (std::size_t k = 0; k < 2 && settings.events.size() > 1; ++k) {
    const auto exponent = [](const Measurement& few, const Measurement& many) {
      return std::log(many.total_ns / few.total_ns) / std::log(many.events / few.events);
    };
    std::printf("growth exponent of ns, %s, %s: %.2f thinned to %zu events, %.2f holding all\n",
                clusters(lines, 1, distortion, 1).front().name.c_str(), name_of(kFinders[k]),
                exponent(first[k].front(), last[k].front()), kThinning, exponent(first[k].back(), last[k].back()));
  }
  return least;
}

void run_worst_cases(const Settings& settings) {
  for (const auto make : {make_texture, make_short_edges, make_pixels_in_turn, make_dense_grid}) {
    for (const std::size_t events : settings.worst_events) {
      const std::vector<Scene> scenes = {make(events)};
      for (const LineFinder finder : kFinders) {
        for (const std::size_t capacity : capacities_for(events)) {
          print_row(scenes, finder, capacity, measure(scenes, finder, capacity, settings.repeats));
        }
      }
    }
  }
}

void print_memory() {
  struct Size {
    std::uint16_t width, height;
    std::size_t events;
  };
  std::printf("\n%-9s %-9s %9s %10s %8s\n", "detector", "sensor", "capacity", "bytes", "B/event");
  for (const Size& size : {Size{320, 320, 4'000}, Size{346, 260, 20'000}, Size{640, 480, 20'000},
                           Size{640, 480, 60'000}, Size{1280, 720, 60'000}}) {
    for (const LineFinder finder : kFinders) {
      const std::size_t bytes = arena_bytes(finder, size.events, size.width, size.height);
      std::printf("%-9s %4ux%-4u %9zu %10zu %8.1f\n", name_of(finder), unsigned{size.width}, unsigned{size.height},
                  size.events, bytes, static_cast<double>(bytes) / static_cast<double>(size.events));
    }
  }
}

/// @return whether all could be read
bool run_recordings(const Settings& settings) {
  if (settings.recordings.empty()) return true;
  std::printf("\nrecordings, from bytes to lines; ns per event for reading, decoding, cutting and detecting\n");
  std::printf("%-9s %10s %8s %8s %8s %8s %8s %8s %8s\n", "detector", "events", "windows", "lines", "Mev/s", "read",
              "decode", "cut", "detect");
  for (const auto& [path, sensor] : settings.recordings) {
    for (const LineFinder finder : kFinders) {
      const auto result = measure_recording(path, sensor, finder);
      if (!result.ok()) {
        std::fprintf(stderr, "%s\n", host::to_string(result.error()).c_str());
        return false;
      }
      const Throughput& t = result.value();
      const double total_ns = t.read_ns + t.decode_ns + t.window_ns + t.detect_ns;
      std::printf("%-9s %10.0f %8.0f %8.0f %8.2f %8.1f %8.1f %8.1f %8.1f  %s\n", name_of(finder), t.events, t.windows,
                  t.lines, 1e3 * t.events / total_ns, t.read_ns / t.events, t.decode_ns / t.events,
                  t.window_ns / t.events, t.detect_ns / t.events, path.c_str());
      std::fflush(stdout);
    }
  }
  return true;
}

[[noreturn]] void usage() {
  std::fprintf(stderr, "usage: bench_lines [--quick] [--seeds N] [[--sensor WxH] RECORDING...]\n");
  std::exit(EXIT_FAILURE);
}

Settings read_settings(int argc, char** argv) {
  Settings settings;
  std::string sensor;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--quick") {
      settings.lines = {5};
      settings.events = {20'000};
      settings.worst_events = {20'000};
      settings.seeds = 2;
      settings.repeats = 1;
    } else if (argument == "--seeds" && i + 1 < argc) {
      settings.seeds = std::strtoull(argv[++i], nullptr, 10);
      if (settings.seeds == 0) usage();
    } else if (argument == "--sensor" && i + 1 < argc) {
      sensor = argv[++i];
    } else if (argument.rfind("--", 0) == 0) {
      usage();
    } else {
      settings.recordings.push_back({argument, sensor});
    }
  }
  return settings;
}

}  // namespace

int main(int argc, char** argv) {
  const Settings settings = read_settings(argc, argv);
  print_heading();
  double easy_recall = 1;
  for (const std::size_t lines : settings.lines) {
    for (const double distortion : {0.0, -0.1}) {
      const double recall = run_clusters(lines, distortion, settings);
      if (lines == settings.lines.front()) easy_recall = std::fmin(easy_recall, recall);
    }
  }
  run_worst_cases(settings);
  print_memory();
  const bool is_read = run_recordings(settings);
  if (easy_recall >= kEasyRecall) return is_read ? EXIT_SUCCESS : EXIT_FAILURE;
  std::fprintf(stderr, "recall with %zu lines is %.3f, expected %.1f\n", settings.lines.front(), easy_recall,
               kEasyRecall);
  return EXIT_FAILURE;
}
